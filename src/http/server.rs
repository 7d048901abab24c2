//! Connections: how many there may be at once, and how long each may take to say what it wants and to read the answer.

use std::io;
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio_io_timeout::TimeoutStream;
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;
use tower::ServiceExt;

use super::caller::Peer;
use super::silence::{Connection, SilentConnections};

/// Longest time from the opening of a connection, or from its last answer, to the end of a request's head.
const HEAD_TIMEOUT: Duration = Duration::from_secs(10);

/// Longest time for which a client may take nothing of an answer that is ready.
const READ_TIMEOUT: Duration = Duration::from_secs(30);

/// Longest head of a request, bytes.
const LONGEST_HEAD: usize = 64 << 10;

/// How long to wait when no connection can be accepted, such as when there are no more file descriptors.
const ACCEPT_PAUSE: Duration = Duration::from_millis(200);

/// Serves `router` on `listener`, at most `connections` at once, until `shutdown` is cancelled; then waits for those
/// that are open. Others wait until one of them ends; of those on which nothing is being answered the oldest is ended
/// for them.
///
/// # Errors
///
/// None once it runs; what fails on a connection ends that connection.
pub(super) async fn serve(
    listener: TcpListener,
    router: Router,
    connections: usize,
    shutdown: CancellationToken,
) -> io::Result<()> {
    let places = Arc::new(Semaphore::new(connections));
    let silent = Arc::new(SilentConnections::default());
    let open = TaskTracker::new();
    loop {
        let (stream, peer) = tokio::select! {
            accepted = accept(&listener) => accepted,
            () = shutdown.cancelled() => break,
        };
        if places.available_permits() == 0 && silent.end_oldest() {
            metrics::counter!("gaitwright_connections_ended_total").increment(1);
        }
        let place = tokio::select! {
            place = Arc::clone(&places).acquire_owned() => place.map_err(io::Error::other)?,
            () = shutdown.cancelled() => break,
        };
        let connection = Connection::open(&silent);
        open.spawn(converse((stream, peer), router.clone(), shutdown.clone(), connection, place));
    }
    drop(listener);
    open.close();
    open.wait().await;
    Ok(())
}

async fn accept(listener: &TcpListener) -> (TcpStream, Peer) {
    loop {
        match listener.accept().await {
            Ok((stream, peer)) => return (stream, Peer(peer.ip())),
            // The client has left before it was its turn.
            Err(error) if error.kind() == io::ErrorKind::ConnectionAborted => {}
            Err(error) => {
                tracing::error!(%error, "no connection can be accepted");
                tokio::time::sleep(ACCEPT_PAUSE).await;
            }
        }
    }
}

/// Answers the requests of a connection until it ends or has to give way, or until the answer that is under way at the
/// shutdown.
async fn converse(
    (stream, peer): (TcpStream, Peer),
    router: Router,
    shutdown: CancellationToken,
    connection: Arc<Connection>,
    _place: OwnedSemaphorePermit,
) {
    // Events are short, and each is to arrive at once.
    if let Err(error) = stream.set_nodelay(true) {
        tracing::debug!(%error, "small packets may wait");
    }
    let mut stream = Box::pin(TimeoutStream::new(stream));
    stream.as_mut().set_write_timeout_pinned(Some(READ_TIMEOUT));
    let service = service_fn(|request: hyper::Request<Incoming>| {
        let (answering, router) = (connection.answer(), router.clone());
        async move {
            let mut request = request.map(Body::new);
            request.extensions_mut().insert(peer);
            router.oneshot(request).await.map(|response| answering.with(response))
        }
    });
    let mut builder = http1::Builder::new();
    builder.timer(TokioTimer::new()).header_read_timeout(HEAD_TIMEOUT).max_buf_size(LONGEST_HEAD);
    let mut serving = pin!(builder.serve_connection(TokioIo::new(stream), service));
    let ended = tokio::select! {
        ended = serving.as_mut() => ended,
        () = connection.ended().cancelled() => return,
        () = shutdown.cancelled() => {
            serving.as_mut().graceful_shutdown();
            serving.await
        }
    };
    if let Err(error) = ended {
        tracing::debug!(%error, "a connection broke off");
    }
}
