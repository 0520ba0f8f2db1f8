-- The class of processors whose bits a job's sums have, once its first batch was handed out.
ALTER TABLE job ADD COLUMN class TEXT;
-- Why a worker was put aside.
ALTER TABLE worker ADD COLUMN reason TEXT;

-- Who may call. A token itself is not kept.
CREATE TABLE token (
    id TEXT PRIMARY KEY,
    name TEXT NOT NULL,
    role TEXT NOT NULL,
    hash TEXT NOT NULL UNIQUE,
    created_ms BIGINT NOT NULL
);
