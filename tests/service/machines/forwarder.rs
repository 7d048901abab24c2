//! A way to a server that can be blocked: what is sent is neither delivered nor refused, as when a network is cut.

use std::io::{Read, Write};
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Passes on what comes to a port of its own.
pub struct Forwarder {
    port: u16,
    delay: Arc<AtomicU64>,
}

/// The delay of a way that is blocked.
const BLOCKED: u64 = u64::MAX;

impl Forwarder {
    /// One to `target` on this machine.
    pub fn to(target: u16) -> Self {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        let port = listener.local_addr().unwrap().port();
        let delay = Arc::new(AtomicU64::new(0));
        let way = Arc::clone(&delay);
        std::thread::spawn(move || {
            for client in listener.incoming() {
                let (client, way) = (client.unwrap(), Arc::clone(&way));
                std::thread::spawn(move || {
                    wait(&way);
                    let Ok(server) = TcpStream::connect((Ipv4Addr::LOCALHOST, target)) else { return };
                    let (back, forth) = (client.try_clone().unwrap(), server.try_clone().unwrap());
                    let there = Arc::clone(&way);
                    std::thread::spawn(move || pass(server, back, &there));
                    pass(client, forth, &way);
                });
            }
        });
        Self { port, delay }
    }

    /// Where it listens.
    pub fn port(&self) -> u16 {
        self.port
    }

    /// Keeps everything to itself from now on.
    pub fn block(&self) {
        self.delay.store(BLOCKED, Ordering::Relaxed);
    }

    /// Takes so many milliseconds for every piece, in either direction.
    pub fn slow_down(&self, milliseconds: u64) {
        self.delay.store(milliseconds, Ordering::Relaxed);
    }

    /// Passes everything on at once, what was kept first.
    pub fn open(&self) {
        self.delay.store(0, Ordering::Relaxed);
    }
}

fn wait(way: &AtomicU64) {
    loop {
        match way.load(Ordering::Relaxed) {
            BLOCKED => std::thread::sleep(Duration::from_millis(20)),
            milliseconds => return std::thread::sleep(Duration::from_millis(milliseconds)),
        }
    }
}

fn pass(mut from: TcpStream, mut to: TcpStream, way: &AtomicU64) {
    let mut piece = vec![0; 64 << 10];
    while let Ok(length @ 1..) = from.read(&mut piece) {
        wait(way);
        if to.write_all(&piece[..length]).is_err() {
            break;
        }
    }
    wait(way);
    // Either may have gone.
    let _ = to.shutdown(Shutdown::Both);
    let _ = from.shutdown(Shutdown::Both);
}
