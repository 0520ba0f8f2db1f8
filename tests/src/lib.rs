//! What the tests share: scenes made by code, and renders of them without a farm.

pub mod browser;
pub mod calibration;
pub mod clock;
pub mod collector;
pub mod corpus;
pub mod glb;
pub mod hostile;
pub mod irradiance;
pub mod job_promises;
pub mod lamps;
pub mod matrix;
pub mod mutate;
pub mod mutation;
pub mod picture;
pub mod program;
pub mod promises;
pub mod proxy;
pub mod room;
pub mod scenes;
pub mod services;
pub mod showcase;
pub mod stability;
pub mod stage;
pub mod tended;
pub mod textures;
pub mod thread_time;
