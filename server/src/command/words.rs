//! Numbers as people read them.

use ovtigre_proto::status::JobStatus;

/// Seconds as `12.3 s`, `4:05` or `1:02:03`.
pub(crate) fn duration(seconds: f64) -> String {
    if !seconds.is_finite() || seconds < 0.0 {
        return "?".to_owned();
    }
    if seconds < 60.0 {
        return format!("{seconds:.1} s");
    }
    let whole = seconds.round() as u64;
    let (hours, minutes, rest) = (whole / 3600, whole / 60 % 60, whole % 60);
    if hours > 0 { format!("{hours}:{minutes:02}:{rest:02}") } else { format!("{minutes}:{rest:02}") }
}

/// Bytes as `12.3 MB`.
pub(crate) fn bytes(count: u64) -> String {
    let mut left = count as f64;
    for unit in ["B", "kB", "MB", "GB"] {
        if left < 999.5 {
            return if unit == "B" { format!("{count} B") } else { format!("{left:.1} {unit}") };
        }
        left /= 1000.0;
    }
    format!("{left:.1} TB")
}

/// The relative error and its upper bound; empty where there is none.
pub(crate) fn error(status: &JobStatus) -> String {
    let row = status.error.as_ref();
    if let (true, Some(spread)) = (status.settings.method.has_bias(), row.and_then(|row| row.relative_error))
    {
        return format!("error ±{spread:.4} by spread alone");
    }
    match row.map(|row| (row.relative_error, row.relative_error_upper, &row.doubt)) {
        Some((Some(error), _, Some(_))) => format!("error ±{error:.4} (not certified)"),
        Some((Some(error), Some(upper), None)) => format!("error ±{error:.4} (at most {upper:.4})"),
        Some((Some(error), None, None)) => format!("error ±{error:.4}"),
        _ => String::new(),
    }
}

/// Samples so far of those asked for: whole ones, the fraction of a picture that is cut is no news.
pub(crate) fn samples(status: &JobStatus) -> String {
    format!("{:.0}/{} samples", status.samples_done, status.samples_asked)
}

/// Million rays a second since the job began.
pub(crate) fn speed(status: &JobStatus) -> String {
    if status.wall_seconds > 0.0 && status.rays > 0 {
        format!("{:.1} Mray/s", status.rays as f64 * 1e-6 / status.wall_seconds)
    } else {
        String::new()
    }
}

/// The parts that say something, with commas.
pub(crate) fn list(parts: &[String]) -> String {
    parts.iter().filter(|part| !part.is_empty()).cloned().collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_and_sizes_are_short() {
        for (seconds, text) in [
            (0.0, "0.0 s"),
            (59.94, "59.9 s"),
            (61.2, "1:01"),
            (3599.7, "1:00:00"),
            (f64::NAN, "?"),
            (-1.0, "?"),
        ] {
            assert_eq!(duration(seconds), text);
        }
        for (count, text) in [(0, "0 B"), (999, "999 B"), (1_500, "1.5 kB"), (123_456_789, "123.5 MB")] {
            assert_eq!(bytes(count), text);
        }
    }
}
