//! Error against time of path, light and bidirectional: `cargo bench -p ovtigre-tests --bench methods --
//! [--seconds S] [--side PIXELS]`.
//!
//! Each method renders for some seconds of thread time in turn, 6 where it is not said, 96×96 pixels; the table gives error² × seconds relative to `path`: how much
//! more time a method needs for the same error.

use ovtigre_core::settings::{Method, Settings};
use ovtigre_tests::{
    picture::{rendered, settings},
    scenes::cornell,
    showcase::{caustic, lamp_behind_glass},
};
use std::time::Instant;

/// The number after a flag.
fn asked(flag: &str, default: f64) -> f64 {
    let given = std::env::args().skip_while(|word| word != flag).nth(1);
    given.map_or(default, |number| number.parse().expect("a number"))
}

fn main() {
    let (seconds, side) = (asked("--seconds", 6.0), asked("--side", 96.0) as u32);
    let scenes: [(&str, Vec<u8>); 3] =
        [("diffuse room", cornell()), ("caustic", caustic()), ("lamp behind glass", lamp_behind_glass())];
    for (name, glb) in scenes {
        let mut path = None;
        for method in [Method::Path, Method::Light, Method::Bidirectional] {
            let (error, seconds) = measure(&glb, method, side, seconds);
            let cost = error * error * seconds;
            let relative = cost / *path.get_or_insert(cost);
            print(&format!(
                "{name}, {}: relative error {error:.4} in {seconds:.2} s; time for the same error {relative:.2}",
                method.name()
            ));
        }
    }
}

#[expect(clippy::print_stdout, reason = "a benchmark's result")]
fn print(line: &str) {
    println!("{line}");
}

/// Relative error by 16 replicates, and the seconds it took on one thread, about as many as asked for.
fn measure(glb: &[u8], method: Method, side: u32, asked: f64) -> (f64, f64) {
    let settings = Settings { method, ..settings(side, side, 16) };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    pool.install(|| {
        // Once to warm up, and to see how many samples fit.
        let start = Instant::now();
        rendered(glb, &settings, 1);
        let once = start.elapsed().as_secs_f64();
        let samples = ((asked / once) as u32).clamp(2, 256).next_power_of_two();
        let start = Instant::now();
        let error = rendered(glb, &settings, samples).error().relative;
        (error, start.elapsed().as_secs_f64())
    })
}
