-- The error of each layer at a checkpoint: a JSON list in the order of the job's layers.
ALTER TABLE checkpoint ADD COLUMN layers TEXT NOT NULL DEFAULT '[]';
