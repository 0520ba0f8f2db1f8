//! Leases batches, renders them and sends back their sums.
