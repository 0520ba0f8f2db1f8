//! `ovtigre token`: who may call a farm.

use super::{
    exit::{CommandError, Outcome},
    secret, table, terminal,
};
use clap::{Args, Subcommand};
use ovtigre::{
    api::guard::hash,
    store::{
        Store,
        row::{Role, TokenRow},
        sql::Sql,
    },
};
use std::path::PathBuf;

/// Make, list and revoke the tokens of a farm. Where there are none, only this machine can call it.
#[derive(Args, Debug)]
pub(crate) struct Token {
    #[command(subcommand)]
    what: What,
    /// Folder of the farm's memory.
    #[arg(long, value_name = "DIR", default_value = "ovtigre-data", global = true)]
    data: PathBuf,
    /// The farm's PostgreSQL database, where it has one. [env: `OVTIGRE_DATABASE`]
    #[arg(long, value_name = "URL", global = true)]
    database: Option<String>,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Make a token and print it: it is shown this once, and only its hash is kept.
    Create {
        /// What it may do: admin, submit, read or work.
        #[arg(long, value_name = "ROLE")]
        role: Role,
        /// A name for people.
        #[arg(long, value_name = "NAME", default_value = "")]
        name: String,
    },
    /// Show all tokens, without the tokens themselves.
    List,
    /// Forget a token: from the next second on it opens nothing.
    Revoke {
        /// Its id, as in the list.
        #[arg(value_name = "ID")]
        id: String,
    },
}

impl Token {
    /// Does it.
    pub(crate) async fn run(self) -> Outcome {
        let store = self.open().await?;
        let done = carry_out(&store, self.what).await;
        store.close().await;
        done
    }

    async fn open(&self) -> Outcome<Sql> {
        let database = self.database.clone().or_else(|| std::env::var("OVTIGRE_DATABASE").ok());
        let opened = if let Some(url) = database {
            Sql::server(&url).await
        } else {
            std::fs::create_dir_all(&self.data).map_err(|e| {
                CommandError::wrong(format!("the folder '{}' cannot be used: {e}", self.data.display()))
            })?;
            Sql::beside(&self.data.join("farm.sqlite")).await
        };
        opened.map_err(|e| CommandError::wrong(e.to_string()))
    }
}

async fn carry_out(store: &Sql, what: What) -> Outcome {
    let failed = |e: ovtigre::store::error::StoreError| CommandError::failed(e.to_string());
    match what {
        What::Create { role, name } => {
            if name.chars().any(char::is_control) || name.len() > 200 {
                return Err(CommandError::wrong("a name has 200 bytes at most and no control characters"));
            }
            let token = secret::token()?;
            let hash = hash(&token);
            let id = hash.as_str()[..12].to_owned();
            store.add_token(TokenRow { id, name, role, hash, created_at: None }).await.map_err(failed)?;
            terminal::result(&token);
        }
        What::List => {
            let rows = store.tokens().await.map_err(failed)?;
            let rows: Vec<[String; 4]> = (rows.into_iter())
                .map(|row| {
                    let at = row.created_at.map(|at| at.to_string()).unwrap_or_default();
                    [row.id, row.role.name().to_owned(), row.name, at]
                })
                .collect();
            table::print(["TOKEN", "ROLE", "NAME", "CREATED"], &rows);
        }
        What::Revoke { id } => {
            if !store.remove_token(&id).await.map_err(failed)? {
                return Err(CommandError::wrong(format!("there is no token '{id}'")));
            }
            terminal::result(&id);
        }
    }
    Ok(())
}
