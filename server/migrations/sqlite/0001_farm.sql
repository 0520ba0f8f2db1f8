-- Times are milliseconds since 1970 by this database's clock.

CREATE TABLE scene (
    id TEXT PRIMARY KEY,
    bytes INTEGER NOT NULL,
    report TEXT NOT NULL,
    created_ms INTEGER NOT NULL
) STRICT;

CREATE TABLE job (
    sequence INTEGER PRIMARY KEY AUTOINCREMENT,
    id TEXT NOT NULL UNIQUE,
    name TEXT NOT NULL,
    scene TEXT NOT NULL,
    state TEXT NOT NULL,
    reason TEXT,
    version INTEGER NOT NULL,
    priority INTEGER NOT NULL,
    created_ms INTEGER NOT NULL,
    started_ms INTEGER,
    ended_ms INTEGER,
    -- Time spent paused, and since when it is paused now.
    paused_ms INTEGER NOT NULL DEFAULT 0,
    paused_since_ms INTEGER,
    -- The farm's own document: request, settings, targets.
    spec TEXT NOT NULL,
    progress TEXT NOT NULL,
    certified INTEGER NOT NULL DEFAULT 0,
    -- The set of batches in the picture that is kept, once the job is over.
    manifest TEXT,
    -- Whether a job that is over has its files in their last form.
    settled INTEGER NOT NULL DEFAULT 0
) STRICT;

CREATE INDEX job_by_state ON job (state, sequence);
CREATE INDEX job_unsettled ON job (sequence) WHERE settled = 0;

CREATE TABLE idempotency (
    key TEXT PRIMARY KEY,
    fingerprint TEXT NOT NULL,
    job TEXT NOT NULL,
    created_ms INTEGER NOT NULL
) STRICT;

-- The next block to hand out of each sequence of samples.
CREATE TABLE cursor (
    job TEXT NOT NULL,
    region INTEGER NOT NULL,
    replicate INTEGER NOT NULL,
    next_block INTEGER NOT NULL,
    PRIMARY KEY (job, region, replicate)
) STRICT, WITHOUT ROWID;

-- Blocks behind the cursor that nobody holds and nobody brought.
CREATE TABLE returned (
    job TEXT NOT NULL,
    region INTEGER NOT NULL,
    replicate INTEGER NOT NULL,
    block INTEGER NOT NULL,
    PRIMARY KEY (job, region, replicate, block)
) STRICT, WITHOUT ROWID;

-- Work in flight.
CREATE TABLE lease (
    id TEXT PRIMARY KEY,
    job TEXT NOT NULL,
    region INTEGER NOT NULL,
    replicate INTEGER NOT NULL,
    block INTEGER NOT NULL,
    worker TEXT NOT NULL,
    granted_ms INTEGER NOT NULL,
    ends_ms INTEGER NOT NULL,
    UNIQUE (job, region, replicate, block)
) STRICT, WITHOUT ROWID;

CREATE INDEX lease_by_end ON lease (ends_ms);
CREATE INDEX lease_by_worker ON lease (worker);

CREATE TABLE commits (
    job TEXT NOT NULL,
    region INTEGER NOT NULL,
    replicate INTEGER NOT NULL,
    block INTEGER NOT NULL,
    hash TEXT NOT NULL,
    worker TEXT NOT NULL,
    worker_micros INTEGER NOT NULL,
    committed_ms INTEGER NOT NULL,
    PRIMARY KEY (job, region, replicate, block)
) STRICT, WITHOUT ROWID;

-- Sums that differ from the one that counts.
CREATE TABLE disagreement (
    job TEXT NOT NULL,
    region INTEGER NOT NULL,
    replicate INTEGER NOT NULL,
    block INTEGER NOT NULL,
    hash TEXT NOT NULL,
    worker TEXT NOT NULL,
    seen_ms INTEGER NOT NULL,
    PRIMARY KEY (job, region, replicate, block, hash)
) STRICT, WITHOUT ROWID;

CREATE TABLE failure (
    job TEXT NOT NULL,
    region INTEGER NOT NULL,
    replicate INTEGER NOT NULL,
    block INTEGER NOT NULL,
    worker TEXT NOT NULL,
    reason TEXT NOT NULL,
    -- Whether the worker was lost, and said nothing.
    lost INTEGER NOT NULL,
    failed_ms INTEGER NOT NULL
) STRICT;

CREATE INDEX failure_by_batch ON failure (job, region, replicate, block);

-- How far each sequence is kept as one blob of sums.
CREATE TABLE snapshot (
    job TEXT NOT NULL,
    region INTEGER NOT NULL,
    replicate INTEGER NOT NULL,
    blocks INTEGER NOT NULL,
    PRIMARY KEY (job, region, replicate)
) STRICT, WITHOUT ROWID;

CREATE TABLE checkpoint (
    job TEXT NOT NULL,
    look INTEGER NOT NULL,
    samples INTEGER NOT NULL,
    wall_seconds REAL NOT NULL,
    worker_seconds REAL NOT NULL,
    rays INTEGER NOT NULL,
    rms_error REAL,
    relative_error REAL,
    relative_error_upper REAL,
    PRIMARY KEY (job, look)
) STRICT, WITHOUT ROWID;

CREATE TABLE worker (
    sequence INTEGER PRIMARY KEY AUTOINCREMENT,
    id TEXT NOT NULL UNIQUE,
    name TEXT NOT NULL,
    threads INTEGER NOT NULL,
    build TEXT NOT NULL,
    instruction_set TEXT NOT NULL,
    tags TEXT NOT NULL,
    state TEXT NOT NULL,
    joined_ms INTEGER NOT NULL,
    seen_ms INTEGER NOT NULL,
    batches_done INTEGER NOT NULL DEFAULT 0,
    failures INTEGER NOT NULL DEFAULT 0,
    rays_per_second REAL NOT NULL DEFAULT 0
) STRICT;
