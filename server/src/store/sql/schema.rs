//! A place of its own on a PostgreSQL server, for a test.

use super::{connection::To, open::Source};

/// A PostgreSQL server to test with.
const SERVER: &str = "OVTIGRE_TEST_POSTGRES";

/// The address of an empty schema; `None` where no server is there, which is said.
pub(crate) async fn schema(name: &str) -> Option<String> {
    let Ok(server) = std::env::var(SERVER) else {
        eprintln!("SKIPPED: {SERVER} is not set: nothing was tested with PostgreSQL");
        return None;
    };
    let name = format!("test_{}_{name}", std::process::id());
    let mut db = Source::server(&server).unwrap().connect().await.unwrap();
    let To::Postgres(connection) = &mut db.to else { unreachable!("an address of PostgreSQL") };
    let create = sqlx::AssertSqlSafe(format!("CREATE SCHEMA {name}"));
    sqlx::query(create).execute(connection).await.unwrap();
    let mark = if server.contains('?') { '&' } else { '?' };
    Some(format!("{server}{mark}options=-csearch_path%3D{name}"))
}
