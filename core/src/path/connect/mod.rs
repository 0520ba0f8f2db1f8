//! Where subpaths become paths: one file a kind of joint, each with the weight of its technique.

pub mod hit;
pub mod join;
pub mod lens;
pub mod light_vertex;
pub mod next_event;
pub mod squares;
pub mod unblocked;
pub mod whole;
