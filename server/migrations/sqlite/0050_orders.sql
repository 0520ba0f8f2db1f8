-- Lists of jobs by other things than when they came, of all jobs and of those in one state.
CREATE INDEX job_by_name ON job (lower(name), sequence);
CREATE INDEX job_by_state_and_name ON job (state, lower(name), sequence);
CREATE INDEX job_by_priority ON job (priority, sequence);
CREATE INDEX job_by_state_and_priority ON job (state, priority, sequence);
