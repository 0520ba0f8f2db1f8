//! What a picture is asked to be.
