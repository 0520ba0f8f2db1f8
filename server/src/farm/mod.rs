//! Rules, no HTTP: submit, split, lease, commit, append, checkpoint, stop, reap.
