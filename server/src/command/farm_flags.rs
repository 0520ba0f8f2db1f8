//! The flags of commands that ask a farm.

use super::exit::Outcome;
use clap::Args;
use ovtigre_proto::client::farm::Client;
use std::process::id;

/// Which farm, and how its answers are shown.
#[derive(Args, Clone, Debug)]
pub(crate) struct FarmFlags {
    /// The farm's address.
    #[arg(long, value_name = "URL", default_value = "http://127.0.0.1:7700")]
    pub(crate) server: String,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

impl FarmFlags {
    /// A client of it.
    pub(crate) fn client(&self) -> Outcome<Client> {
        client(&self.server)
    }
}

/// A client of the farm at `address`.
pub(crate) fn client(address: &str) -> Outcome<Client> {
    Ok(Client::new(address, u64::from(id()))?)
}
