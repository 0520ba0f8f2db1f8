//! What each kernel that is compiled for less than everything gains over the general one:
//! `cargo bench -p ovtigre-tests --bench kernels -- [--rounds N]`, the table of docs/PERFORMANCE.md.
//!
//! Both render the same batch in turns; time is that of one thread on a processor over all rounds, as the system counts it in steps
//! of some milliseconds.

use ovtigre_core::{
    film::batch::{Batch, Block},
    render::{
        batch::{Kernel, render_by},
        progress::Progress,
    },
    settings::{Method, Settings},
};
use ovtigre_tests::{
    picture::{scene, settings},
    room::room,
    scenes::{cornell, furnace},
    showcase::caustic,
    thread_time::thread_seconds,
};

const METHODS: [Method; 3] = [Method::Path, Method::Light, Method::Bidirectional];

fn main() {
    let asked = std::env::args().skip_while(|word| word != "--rounds").nth(1);
    let rounds: usize = asked.map_or(15, |n| n.parse().expect("a number of rounds"));
    print("| scene | method | samples a second, general | every path of one picture | gain |");
    print("| --- | --- | ---: | ---: | ---: |");
    let scenes: [(&str, Vec<u8>); 4] =
        [("room", room()), ("cornell", cornell()), ("white room", furnace(0.9, 1.0)), ("caustic", caustic())];
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    for (name, glb) in scenes {
        for method in METHODS {
            let [general, fitting] = pool.install(|| measure(&glb, method, rounds));
            print(&format!(
                "| {name} | {} | {:.0} thousand | {:.0} thousand | {:+.1} % |",
                method.name(),
                1e-3 * general,
                1e-3 * fitting,
                100.0 * (fitting / general - 1.0)
            ));
        }
    }
}

/// Samples a second by the general kernel and by the fitting one.
fn measure(glb: &[u8], method: Method, rounds: usize) -> [f64; 2] {
    let settings = Settings { method, ..settings(96, 54, 1) };
    let scene = scene(glb, &settings);
    let block = Block { index: 3, start: 4, count: 4 };
    let batch = Batch { region: settings.size.frame(), replicate: 0, block };
    let samples = settings.size.pixels() as f64 * f64::from(batch.block.count);
    let mut seconds = [0.0; 2];
    for _ in 0..rounds {
        for (kernel, whole) in [Kernel::General, Kernel::Fitting].into_iter().zip(&mut seconds) {
            let start = thread_seconds();
            let sum = render_by(kernel, &scene, &settings, batch, &Progress::new());
            *whole += thread_seconds() - start;
            sum.expect("nobody stops it");
        }
    }
    seconds.map(|whole| samples * rounds as f64 / whole)
}

#[expect(clippy::print_stdout, reason = "a benchmark's result")]
fn print(line: &str) {
    println!("{line}");
}
