//! Connections on which nothing is being answered: they give way when others need their place.

use std::collections::BTreeMap;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll};

use axum::body::{Body, Bytes, HttpBody};
use axum::http::Response;
use http_body::{Frame, SizeHint};
use tokio_util::sync::CancellationToken;

/// The silent connections, from the one that has been so longest.
#[derive(Debug, Default)]
pub(super) struct SilentConnections {
    queue: Mutex<Queue>,
}

#[derive(Debug, Default)]
struct Queue {
    next: u64,
    connections: BTreeMap<u64, CancellationToken>,
}

/// A connection among those that may be silent; silent from its opening to the first request.
#[derive(Debug)]
pub(super) struct Connection {
    all: Arc<SilentConnections>,
    ended: CancellationToken,
    /// Its place in the queue while it is silent, and how many answers are under way.
    state: Mutex<(Option<u64>, usize)>,
}

impl SilentConnections {
    /// Ends the connection that has been silent longest; whether there was one.
    pub(super) fn end_oldest(&self) -> bool {
        let oldest = self.queue().connections.pop_first();
        oldest.map(|(_, ended)| ended.cancel()).is_some()
    }

    fn enter(&self, ended: &CancellationToken) -> u64 {
        let mut queue = self.queue();
        let number = queue.next;
        queue.next += 1;
        queue.connections.insert(number, ended.clone());
        number
    }

    fn leave(&self, number: u64) {
        self.queue().connections.remove(&number);
    }

    fn queue(&self) -> MutexGuard<'_, Queue> {
        // Nobody panics while holding it.
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Connection {
    /// A connection that has just been opened.
    pub(super) fn open(all: &Arc<SilentConnections>) -> Arc<Self> {
        let ended = CancellationToken::new();
        let state = Mutex::new((Some(all.enter(&ended)), 0));
        Arc::new(Self { all: Arc::clone(all), ended, state })
    }

    /// Cancelled when the connection has to give way.
    pub(super) fn ended(&self) -> &CancellationToken {
        &self.ended
    }

    /// The connection is not silent as long as this is kept.
    pub(super) fn answer(self: &Arc<Self>) -> Answering {
        let mut state = self.state();
        state.1 += 1;
        if let Some(number) = state.0.take() {
            self.all.leave(number);
        }
        Answering(Arc::clone(self))
    }

    fn state(&self) -> MutexGuard<'_, (Option<u64>, usize)> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        if let Some(number) = self.state().0.take() {
            self.all.leave(number);
        }
    }
}

/// An answer is under way.
#[derive(Debug)]
pub(super) struct Answering(Arc<Connection>);

impl Answering {
    /// `response`, under way until its body has been handed over.
    pub(super) fn with(self, response: Response<Body>) -> Response<AnswerBody> {
        response.map(|body| AnswerBody { body, _answering: self })
    }
}

impl Drop for Answering {
    fn drop(&mut self) {
        let mut state = self.0.state();
        state.1 -= 1;
        if state.1 == 0 {
            state.0 = Some(self.0.all.enter(&self.0.ended));
        }
    }
}

/// A body that keeps its connection from counting as silent.
#[derive(Debug)]
pub(super) struct AnswerBody {
    body: Body,
    _answering: Answering,
}

impl HttpBody for AnswerBody {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        Pin::new(&mut self.body).poll_frame(context)
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}
