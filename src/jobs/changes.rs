//! What waits for something to happen to jobs.

use tokio::sync::broadcast::Receiver;
use tokio::sync::broadcast::error::RecvError;
use uuid::Uuid;

/// Jobs that are posted, taken up, put back, over or gone: everything that happens from when this was made on, or since it
/// was last waited for.
#[derive(Debug)]
pub struct Changes(pub(super) Receiver<Uuid>);

impl Changes {
    /// Waits until something happens, to whichever job.
    pub async fn any(&mut self) {
        // A sender lives as long as the service does. Whoever has missed something looks at everything anyway.
        if matches!(self.0.recv().await, Err(RecvError::Closed)) {
            std::future::pending().await
        }
        while self.0.try_recv().is_ok() {}
    }

    /// Waits until something happens to the job called `id`.
    pub async fn of(&mut self, id: Uuid) {
        loop {
            match self.0.recv().await {
                Ok(other) if other != id => {}
                Ok(_) | Err(RecvError::Lagged(_)) => return,
                Err(RecvError::Closed) => std::future::pending().await,
            }
        }
    }
}
