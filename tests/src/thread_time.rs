//! How long a thread has been on a processor.

/// Seconds of this thread so far: what others do on the machine counts little.
pub fn thread_seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").expect("Linux, with /proc mounted");
    let nanoseconds: f64 = text.split_whitespace().next().and_then(|n| n.parse().ok()).expect("a number");
    nanoseconds * 1e-9
}
