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
    /// Token that the farm knows [default: `OVTIGRE_TOKEN` of the environment].
    #[arg(long, value_name = "TOKEN")]
    pub(crate) token: Option<String>,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

impl FarmFlags {
    /// A client of it.
    pub(crate) fn client(&self) -> Outcome<Client> {
        client(&self.server, self.token.as_deref())
    }
}

/// A client of the farm at `address`, with `token` or that of the environment.
pub(crate) fn client(address: &str, token: Option<&str>) -> Outcome<Client> {
    let client = Client::new(address, u64::from(id()))?;
    let of_environment = std::env::var("OVTIGRE_TOKEN").ok().filter(|token| !token.is_empty());
    Ok(client.with_token(token.or(of_environment.as_deref())))
}
