//! All integration tests, one binary.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on panics")]

mod adaptive;
mod auto;
mod backup;
mod bad_input;
mod calibration;
mod caustics;
mod chaos;
mod closed_forms;
mod disk_full;
mod expressions;
mod fail_points;
mod faults;
mod gltf;
mod hostile;
mod lens;
mod many_lights;
mod methods;
mod motion;
mod mutate;
mod page;
mod page_reader;
mod page_readme;
mod page_scene;
mod page_sky;
mod page_workers;
mod photons;
mod radiosity;
mod same_bits;
mod slope;
mod stability;
mod stripped;
mod techniques;
mod telemetry;
mod tidy;
mod tls;
mod tokens;
mod webhooks;
mod weights;
