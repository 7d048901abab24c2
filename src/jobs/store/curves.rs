//! Learning curves, a row a generation.

use sqlx::Row;
use sqlx::sqlite::SqliteConnection;
use uuid::Uuid;

use super::connection::{Store, StoreError, document, read};
use gaitwright_learning::learn::Generation;

impl Store {
    /// A job's learning curve, by generation.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn curve(&self, id: Uuid) -> Result<Vec<Generation>, StoreError> {
        let rows = sqlx::query("SELECT figures FROM generations WHERE job = ? ORDER BY generation")
            .bind(id.to_string())
            .fetch_all(&self.readers)
            .await?;
        rows.iter().map(|row| read(row.try_get("figures")?)).collect()
    }
}

/// Adds points to a job's curve, within somebody's changes.
pub(super) async fn extend(
    connection: &mut SqliteConnection,
    id: &str,
    curve: &[Generation],
) -> Result<(), StoreError> {
    for figures in curve {
        sqlx::query("INSERT OR REPLACE INTO generations (job, generation, figures) VALUES (?, ?, ?)")
            .bind(id)
            .bind(figures.generation)
            .bind(document(figures)?)
            .execute(&mut *connection)
            .await?;
    }
    Ok(())
}

/// Forgets a job's curve, within somebody's changes.
pub(super) async fn forget(connection: &mut SqliteConnection, id: &str) -> Result<(), StoreError> {
    sqlx::query("DELETE FROM generations WHERE job = ?").bind(id).execute(connection).await?;
    Ok(())
}
