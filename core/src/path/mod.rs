//! What all methods share: vertices, media, next events, walks.

pub mod expression;
pub mod media;
pub mod next_event;
pub mod vertex;
pub mod walk;
