//! How much of what is over is kept: `30d`, `200GB`.

use ovtigre::farm::keep::Kept;
use std::time::Duration;

/// One bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Limit {
    /// So long.
    Time(Duration),
    /// So many bytes.
    Bytes(u64),
}

/// What a unit stands for.
enum Unit {
    Seconds(f64),
    Bytes(f64),
}

const UNITS: [(&str, Unit); 11] = [
    ("h", Unit::Seconds(3600.0)),
    ("d", Unit::Seconds(86_400.0)),
    ("w", Unit::Seconds(604_800.0)),
    ("y", Unit::Seconds(31_557_600.0)),
    // Earlier versions took days without a unit.
    ("", Unit::Seconds(86_400.0)),
    ("MB", Unit::Bytes(1e6)),
    ("GB", Unit::Bytes(1e9)),
    ("TB", Unit::Bytes(1e12)),
    ("MiB", Unit::Bytes(1_048_576.0)),
    ("GiB", Unit::Bytes(1_073_741_824.0)),
    ("TiB", Unit::Bytes(1_099_511_627_776.0)),
];

/// One bound as it is written.
pub(crate) fn limit(text: &str) -> Result<Limit, String> {
    let wrong =
        || "it is a time, such as 30d, or a size, such as 200GB: units are h d w y, MB GB TB, MiB GiB TiB";
    let digits = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let (number, name) = text.split_at(digits);
    let number: f64 = number.parse().map_err(|_| wrong())?;
    match UNITS.iter().find(|(unit, _)| unit.eq_ignore_ascii_case(name)).map(|(_, unit)| unit) {
        Some(Unit::Seconds(of)) => {
            let time = Duration::try_from_secs_f64(number * of).map_err(|_| "it is too long".to_owned())?;
            Ok(Limit::Time(time))
        }
        Some(Unit::Bytes(of)) => Ok(Limit::Bytes((number * of) as u64)),
        None => Err(wrong().to_owned()),
    }
}

/// All bounds together; of two of a kind the smaller one.
pub(crate) fn kept(limits: &[Limit]) -> Kept {
    let mut kept = Kept::default();
    for limit in limits {
        match *limit {
            Limit::Time(time) => kept.time = Some(kept.time.map_or(time, |before| before.min(time))),
            Limit::Bytes(bytes) => kept.bytes = Some(kept.bytes.map_or(bytes, |before| before.min(bytes))),
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_and_sizes_are_told_apart_by_their_units() {
        let hours = |n| Limit::Time(Duration::from_hours(n));
        for (text, expected) in [
            ("30d", hours(720)),
            ("30", hours(720)),
            ("0.5d", hours(12)),
            ("36h", hours(36)),
            ("2w", hours(336)),
            ("200GB", Limit::Bytes(200_000_000_000)),
            ("1.5gib", Limit::Bytes(3 << 29)),
            ("0MB", Limit::Bytes(0)),
        ] {
            assert_eq!(limit(text), Ok(expected), "{text}");
        }
        for text in
            ["", "d", "GB", "-1d", "1 d", "1e3d", "12m", "12GBd", "1.2.3d", "99999999999999999999y", "inf"]
        {
            assert!(limit(text).is_err(), "{text}");
        }
    }

    #[test]
    fn of_two_bounds_of_a_kind_the_smaller_one_holds() {
        assert_eq!(kept(&[]), Kept::default());
        let limits = ["8w", "30d", "2TB", "3TB"].map(|text| limit(text).unwrap());
        let both = Kept { time: Some(Duration::from_hours(720)), bytes: Some(2_000_000_000_000) };
        assert_eq!(kept(&limits), both);
    }
}
