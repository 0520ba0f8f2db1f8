-- The tables of migrations/sqlite. Times are milliseconds since 1970 by this database's clock; a truth is 0 or 1.

CREATE TABLE scene (
    id TEXT PRIMARY KEY,
    bytes BIGINT NOT NULL,
    report TEXT NOT NULL,
    created_ms BIGINT NOT NULL
);

-- Rows that change often leave room in their pages, so that a change needs no new entry in any index.
CREATE TABLE job (
    sequence BIGINT GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
    id TEXT NOT NULL UNIQUE,
    name TEXT NOT NULL,
    scene TEXT NOT NULL,
    state TEXT NOT NULL,
    reason TEXT,
    version BIGINT NOT NULL,
    priority BIGINT NOT NULL,
    created_ms BIGINT NOT NULL,
    started_ms BIGINT,
    ended_ms BIGINT,
    -- Time spent paused, and since when it is paused now.
    paused_ms BIGINT NOT NULL DEFAULT 0,
    paused_since_ms BIGINT,
    -- The farm's own document: request, settings, targets.
    spec TEXT NOT NULL,
    progress TEXT NOT NULL,
    certified BIGINT NOT NULL DEFAULT 0,
    -- The set of batches in the picture that is kept, once the job is over.
    manifest TEXT,
    -- Whether a job that is over has its files in their last form.
    settled BIGINT NOT NULL DEFAULT 0,
    -- Batches brought and checkpoints taken: other servers see by them that there is something to do.
    brought BIGINT NOT NULL DEFAULT 0,
    looks BIGINT NOT NULL DEFAULT 0
) WITH (fillfactor = 70);

CREATE INDEX job_by_state ON job (state, sequence);
CREATE INDEX job_unsettled ON job (sequence) WHERE settled = 0;

CREATE TABLE idempotency (
    key TEXT PRIMARY KEY,
    fingerprint TEXT NOT NULL,
    job TEXT NOT NULL,
    created_ms BIGINT NOT NULL
);

CREATE INDEX idempotency_by_job ON idempotency (job);

-- The next block to hand out of each sequence of samples.
CREATE TABLE cursor (
    job TEXT NOT NULL,
    region BIGINT NOT NULL,
    replicate BIGINT NOT NULL,
    next_block BIGINT NOT NULL,
    PRIMARY KEY (job, region, replicate)
) WITH (fillfactor = 70);

-- Blocks behind the cursor that nobody holds and nobody brought.
CREATE TABLE returned (
    job TEXT NOT NULL,
    region BIGINT NOT NULL,
    replicate BIGINT NOT NULL,
    block BIGINT NOT NULL,
    PRIMARY KEY (job, region, replicate, block)
);

-- Work in flight.
CREATE TABLE lease (
    id TEXT PRIMARY KEY,
    job TEXT NOT NULL,
    region BIGINT NOT NULL,
    replicate BIGINT NOT NULL,
    block BIGINT NOT NULL,
    worker TEXT NOT NULL,
    granted_ms BIGINT NOT NULL,
    ends_ms BIGINT NOT NULL,
    UNIQUE (job, region, replicate, block)
) WITH (autovacuum_vacuum_scale_factor = 0.02, autovacuum_vacuum_threshold = 1000);

CREATE INDEX lease_by_end ON lease (ends_ms);
CREATE INDEX lease_by_worker ON lease (worker);

CREATE TABLE commits (
    job TEXT NOT NULL,
    region BIGINT NOT NULL,
    replicate BIGINT NOT NULL,
    block BIGINT NOT NULL,
    hash TEXT NOT NULL,
    worker TEXT NOT NULL,
    worker_micros BIGINT NOT NULL,
    committed_ms BIGINT NOT NULL,
    -- The place in the order of coming within its job.
    number BIGINT NOT NULL,
    PRIMARY KEY (job, region, replicate, block)
);

CREATE INDEX commits_by_number ON commits (job, number);

-- Sums that differ from the one that counts.
CREATE TABLE disagreement (
    job TEXT NOT NULL,
    region BIGINT NOT NULL,
    replicate BIGINT NOT NULL,
    block BIGINT NOT NULL,
    hash TEXT NOT NULL,
    worker TEXT NOT NULL,
    seen_ms BIGINT NOT NULL,
    PRIMARY KEY (job, region, replicate, block, hash)
);

CREATE TABLE failure (
    job TEXT NOT NULL,
    region BIGINT NOT NULL,
    replicate BIGINT NOT NULL,
    block BIGINT NOT NULL,
    worker TEXT NOT NULL,
    reason TEXT NOT NULL,
    -- Whether the worker was lost, and said nothing.
    lost BIGINT NOT NULL,
    failed_ms BIGINT NOT NULL
);

CREATE INDEX failure_by_batch ON failure (job, region, replicate, block);

-- How far each sequence is kept as one blob of sums.
CREATE TABLE snapshot (
    job TEXT NOT NULL,
    region BIGINT NOT NULL,
    replicate BIGINT NOT NULL,
    blocks BIGINT NOT NULL,
    PRIMARY KEY (job, region, replicate)
);

-- Who appends to which job's sums, and how often that has changed.
CREATE TABLE merger (
    job TEXT PRIMARY KEY,
    holder TEXT NOT NULL,
    epoch BIGINT NOT NULL,
    ends_ms BIGINT NOT NULL
) WITH (fillfactor = 70);

CREATE TABLE checkpoint (
    job TEXT NOT NULL,
    look BIGINT NOT NULL,
    samples BIGINT NOT NULL,
    wall_seconds DOUBLE PRECISION NOT NULL,
    worker_seconds DOUBLE PRECISION NOT NULL,
    rays BIGINT NOT NULL,
    rms_error DOUBLE PRECISION,
    relative_error DOUBLE PRECISION,
    relative_error_upper DOUBLE PRECISION,
    -- The error of each layer: a JSON list in the order of the job's layers.
    layers TEXT NOT NULL DEFAULT '[]',
    PRIMARY KEY (job, look)
);

CREATE TABLE worker (
    sequence BIGINT GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
    id TEXT NOT NULL UNIQUE,
    name TEXT NOT NULL,
    threads BIGINT NOT NULL,
    build TEXT NOT NULL,
    instruction_set TEXT NOT NULL,
    tags TEXT NOT NULL,
    state TEXT NOT NULL,
    joined_ms BIGINT NOT NULL,
    seen_ms BIGINT NOT NULL,
    batches_done BIGINT NOT NULL DEFAULT 0,
    failures BIGINT NOT NULL DEFAULT 0,
    rays_per_second DOUBLE PRECISION NOT NULL DEFAULT 0
) WITH (fillfactor = 70);
