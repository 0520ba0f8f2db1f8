//! Processes whose clock is wrong.

use std::{fs, path::Path, process::Command};

/// Stands before the system's own function.
const SOURCE: &str = r#"
#define _GNU_SOURCE
#include <dlfcn.h>
#include <time.h>

int clock_gettime(clockid_t clock, struct timespec *now) {
    int (*real)(clockid_t, struct timespec *) = dlsym(RTLD_NEXT, "clock_gettime");
    int done = real(clock, now);
    if (done == 0 && clock == CLOCK_REALTIME) now->tv_sec += HOURS * 3600;
    return done;
}
"#;

/// The variables of a process whose clock is so many hours wrong; `None` without a C compiler, which is said.
#[expect(clippy::print_stderr, reason = "what a test skips is for people to see")]
pub fn wrong_by(hours: i32, folder: &Path) -> Option<Vec<(String, String)>> {
    let (source, library) = (folder.join("clock.c"), folder.join(format!("clock{hours}.so")));
    fs::write(&source, SOURCE).expect("a folder to write to");
    let mut compile = Command::new("cc");
    compile.args(["-shared", "-fPIC", &format!("-DHOURS=({hours})"), "-o"]).arg(&library).arg(&source);
    if !compile.arg("-ldl").output().is_ok_and(|compiled| compiled.status.success()) {
        eprintln!("SKIPPED: wrong clocks need cc");
        return None;
    }
    let variables = vec![("LD_PRELOAD".to_owned(), library.to_str().expect("a plain path").to_owned())];
    let date = |variables: &[(String, String)]| -> i64 {
        let mut date = Command::new("date");
        let said = date.arg("+%s").envs(variables.iter().map(|(name, value)| (name, value))).output();
        String::from_utf8(said.expect("date runs").stdout).expect("digits").trim().parse().expect("digits")
    };
    let off = date(&variables) - date(&[]) - i64::from(hours) * 3600;
    assert!(off.abs() < 60, "the clock is not {hours} hours wrong: {off} s remain");
    Some(variables)
}
