//! Services that farms are tested with, where `tests/services` has started them.

use sqlx::{AssertSqlSafe, ConnectOptions as _, Connection as _, postgres::PgConnectOptions};
use std::env;

/// A place of its own for a test, on a PostgreSQL server and in a bucket: the flags of a farm there.
#[derive(Clone, Debug)]
pub struct Shared {
    database: String,
    blobs: String,
    /// Of the schema, of the folder in the bucket, and of connections.
    name: String,
}

impl Shared {
    /// For the test of that name; `None` where there are no such services, which is said.
    #[expect(clippy::print_stderr, reason = "what a test skips is for people to see")]
    pub fn place(name: &str) -> Option<Self> {
        let (Ok(server), Ok(bucket)) = (env::var("OVTIGRE_TEST_POSTGRES"), env::var("OVTIGRE_TEST_BUCKET"))
        else {
            eprintln!("SKIPPED: {name} needs PostgreSQL and S3: start it with tests/services");
            return None;
        };
        let name = format!("it_{}_{name}", std::process::id());
        let runtime = tokio::runtime::Runtime::new().expect("threads");
        runtime.block_on(async {
            let options: PgConnectOptions = server.parse().expect("an address of PostgreSQL");
            let mut connection = options.connect().await.expect("the server answers");
            let create = AssertSqlSafe(format!("CREATE SCHEMA {name}"));
            sqlx::query(create).execute(&mut connection).await.expect("a new name");
            connection.close().await.expect("the server is there");
        });
        let mark = if server.contains('?') { '&' } else { '?' };
        let database = format!("{server}{mark}options=-csearch_path%3D{name}&application_name={name}");
        Some(Self { database, blobs: format!("{bucket}/{name}"), name })
    }

    /// Address of the database.
    pub fn database(&self) -> &str {
        &self.database
    }

    /// Ends all connections of farms to this place's database, as when the server is started again; how many there were.
    pub fn end_connections(&self, runtime: &tokio::runtime::Runtime) -> i64 {
        runtime.block_on(async {
            let options: PgConnectOptions = self.database.parse().expect("an address of PostgreSQL");
            let mut connection = options.application_name("").connect().await.expect("the server answers");
            let end =
                "SELECT count(pg_terminate_backend(pid)) FROM pg_stat_activity WHERE application_name = $1";
            let ended = sqlx::query_scalar(end).bind(&self.name).fetch_one(&mut connection).await;
            connection.close().await.ok();
            ended.expect("a superuser may")
        })
    }

    /// Where the S3-compatible server is.
    pub fn endpoint() -> String {
        env::var("AWS_ENDPOINT_URL").expect("set beside the bucket")
    }

    /// Flags of `ovtigre serve`.
    pub fn flags(&self) -> [&str; 4] {
        ["--database", &self.database, "--blobs", &self.blobs]
    }
}
