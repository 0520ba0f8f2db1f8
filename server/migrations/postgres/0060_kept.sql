-- Uploaded files that each job needs. Earlier versions write none: `filing` says up to which job they are all here.
CREATE TABLE job_file (
    job TEXT NOT NULL,
    scene TEXT NOT NULL,
    PRIMARY KEY (job, scene)
);

CREATE INDEX job_file_by_scene ON job_file (scene);

-- One row: the sequence of a job up to which the files of all are in `job_file`.
CREATE TABLE filing (
    one BIGINT PRIMARY KEY,
    upto BIGINT NOT NULL
);

-- When a file was asked for last, and since when it is being removed: its row is gone then, and its bytes may still be there.
CREATE TABLE scene_use (
    scene TEXT PRIMARY KEY,
    used_ms BIGINT NOT NULL,
    dropped_ms BIGINT
);

CREATE INDEX scene_dropped ON scene_use (dropped_ms) WHERE dropped_ms IS NOT NULL;

-- Bytes of the files of a job that is settled, as of that version of it.
CREATE TABLE job_bytes (
    job TEXT PRIMARY KEY,
    version BIGINT NOT NULL,
    bytes BIGINT NOT NULL
);

-- Jobs that are settled, the longest over first.
CREATE INDEX job_settled ON job (ended_ms, sequence) WHERE settled = 1;
