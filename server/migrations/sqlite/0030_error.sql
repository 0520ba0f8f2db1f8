-- What a checkpoint expected of the target, in seconds of run time, and why its error is not certified, as JSON.
ALTER TABLE checkpoint ADD COLUMN target_expected_at_seconds REAL;
ALTER TABLE checkpoint ADD COLUMN doubt TEXT;
