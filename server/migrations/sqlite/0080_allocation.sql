-- How a job's samples are allocated to its tiles from some sample on, as JSON.
CREATE TABLE allocation (
    job TEXT NOT NULL PRIMARY KEY,
    allocations TEXT NOT NULL
) STRICT, WITHOUT ROWID;
