//! A PostgreSQL server of the tests' own, in a folder of its own; Debian's packages have the programs.

use std::fs;
use std::net::{Ipv4Addr, TcpListener};
use std::os::unix::fs::chown;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, Weak};
use std::time::Duration;

use sqlx::postgres::{PgConnectOptions, PgConnection};
use sqlx::{AssertSqlSafe, ConnectOptions, Connection};
use tempfile::TempDir;
use uuid::Uuid;

/// The superuser of the server, whom it lets in without a password.
const USER: &str = "gaitwright";

/// A user whom it lets in with a password only.
const GUARDED: &str = "guarded";

/// A server; it ends with the test.
pub struct Server {
    programs: PathBuf,
    folder: TempDir,
    port: u16,
    process: Mutex<Option<Child>>,
}

/// An empty database of a server.
pub struct Database {
    server: Arc<Server>,
    name: String,
}

/// A port that nobody listens on.
pub fn free_port() -> u16 {
    TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap().local_addr().unwrap().port()
}

/// The folder of the programs: that of the newest version there is.
fn programs() -> PathBuf {
    let versions = fs::read_dir("/usr/lib/postgresql").expect("this test needs Debian's package postgresql");
    let mut folders: Vec<PathBuf> = versions.map(|version| version.unwrap().path().join("bin")).collect();
    folders.retain(|folder| folder.join("initdb").is_file());
    folders.sort();
    folders.pop().expect("this test needs Debian's package postgresql")
}

/// The user `postgres` of that package by number: the programs refuse to run as root.
fn user() -> Option<u32> {
    let number = |program: &[&str]| -> u32 {
        let output = Command::new(program[0]).args(&program[1..]).output().unwrap();
        String::from_utf8(output.stdout).unwrap().trim().parse().unwrap()
    };
    (number(&["id", "-u"]) == 0).then(|| number(&["id", "-u", "postgres"]))
}

impl Server {
    /// A server that this test has for itself.
    pub fn start() -> Arc<Self> {
        let folder = TempDir::new().unwrap();
        if let Some(user) = user() {
            chown(folder.path(), Some(user), Some(user)).unwrap();
        }
        let server = Self { programs: programs(), folder, port: free_port(), process: Mutex::default() };
        let made = server
            .program("initdb")
            .args(["--auth=trust", "--no-sync", "-U", USER, "-E", "UTF8", "-D"])
            .arg(server.data())
            .stdout(Stdio::null())
            .status();
        assert!(made.unwrap().success());
        let rules = server.data().join("pg_hba.conf");
        let others = fs::read_to_string(&rules).unwrap();
        fs::write(rules, format!("host all {GUARDED} all scram-sha-256\n{others}")).unwrap();
        server.rise();
        Arc::new(server)
    }

    /// A server that the tests share that run at the same time.
    fn shared() -> Arc<Self> {
        static SHARED: Mutex<Weak<Server>> = Mutex::new(Weak::new());
        let mut shared = SHARED.lock().unwrap();
        shared.upgrade().unwrap_or_else(|| {
            let server = Self::start();
            *shared = Arc::downgrade(&server);
            server
        })
    }

    fn program(&self, name: &str) -> Command {
        let mut command = Command::new(self.programs.join(name));
        if let Some(user) = user() {
            command.uid(user).gid(user);
        }
        command.current_dir(self.folder.path());
        command
    }

    fn data(&self) -> PathBuf {
        self.folder.path().join("data")
    }

    /// Starts it, or starts it again.
    pub fn rise(&self) {
        let log = fs::File::options().create(true).append(true).open(self.folder.path().join("log")).unwrap();
        let child = self
            .program("postgres")
            .arg("-D")
            .arg(self.data())
            .args([
                "-h",
                "127.0.0.1",
                "-p",
                &self.port.to_string(),
                "-c",
                "unix_socket_directories=",
                "-c",
                "fsync=off",
            ])
            .stdout(Stdio::null())
            .stderr(log)
            .spawn()
            .unwrap();
        *self.process.lock().unwrap() = Some(child);
        for _ in 0..600 {
            let asked = ["-q", "-h", "127.0.0.1", "-p", &self.port.to_string()];
            if self.program("pg_isready").args(asked).status().unwrap().success() {
                return;
            }
            std::thread::sleep(Duration::from_millis(100));
        }
        panic!("the server does not start: {}", self.log());
    }

    /// Ends it in the middle of what it does.
    pub fn fall(&self) {
        if let Some(mut child) = self.process.lock().unwrap().take() {
            // SIGQUIT is its immediate shutdown: the next start recovers as after a crash.
            let sent = Command::new("kill").args(["-QUIT", &child.id().to_string()]).status();
            assert!(sent.unwrap().success());
            child.wait().unwrap();
        }
    }

    fn log(&self) -> String {
        fs::read_to_string(self.folder.path().join("log")).unwrap_or_default()
    }

    /// Where it listens.
    pub fn port(&self) -> u16 {
        self.port
    }

    /// A new database.
    pub async fn database(self: &Arc<Self>) -> Database {
        let database = Database { server: Arc::clone(self), name: format!("d{}", Uuid::now_v7().simple()) };
        let mut connection = self.connect("postgres").await;
        let create = format!("CREATE DATABASE {}", database.name);
        sqlx::query(AssertSqlSafe(create)).execute(&mut connection).await.unwrap();
        connection.close().await.unwrap();
        database
    }

    /// A new database of a user with this password; one on a server.
    pub async fn guarded_database(self: &Arc<Self>, password: &str) -> Database {
        let database = self.database().await;
        let mut connection = self.connect("postgres").await;
        for statement in [
            format!("CREATE ROLE {GUARDED} LOGIN PASSWORD '{password}'"),
            format!("ALTER DATABASE {} OWNER TO {GUARDED}", database.name),
        ] {
            sqlx::query(AssertSqlSafe(statement)).execute(&mut connection).await.unwrap();
        }
        connection.close().await.unwrap();
        database
    }

    async fn connect(&self, database: &str) -> PgConnection {
        let options = PgConnectOptions::new().host("127.0.0.1").port(self.port).username(USER);
        options.database(database).connect().await.unwrap()
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.fall();
    }
}

impl Database {
    /// One on the server that the tests share.
    pub async fn new() -> Self {
        Server::shared().database().await
    }

    /// The server.
    pub fn server(&self) -> &Server {
        &self.server
    }

    /// Its URL for the user with a password, which may be part of it (`:…`).
    pub fn guarded_url(&self, password: &str) -> String {
        format!("postgres://{GUARDED}{password}@127.0.0.1:{}/{}", self.server.port, self.name)
    }

    /// Its URL, as it is reached at `port`.
    pub fn url_at(&self, port: u16) -> String {
        format!("postgres://{USER}@127.0.0.1:{port}/{}", self.name)
    }

    /// Its URL.
    pub fn url(&self) -> String {
        self.url_at(self.server.port)
    }
}
