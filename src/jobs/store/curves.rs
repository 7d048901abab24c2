//! Learning curves, a row a generation.

use sqlx::Row;
use uuid::Uuid;

use super::database::{Store, StoreError, Writing, document, read};
use gaitwright_learning::learn::Generation;

impl Store {
    /// A job's learning curve from generation `first` on.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn curve(&self, id: Uuid, first: u32) -> Result<Vec<Generation>, StoreError> {
        let query = self
            .dialect
            .query("SELECT figures FROM generations WHERE job = $1 AND generation >= $2 ORDER BY generation");
        let rows = self.rows(query.bind(id.to_string()).bind(i64::from(first))).await?;
        rows.iter().map(|row| read(row.try_get("figures")?)).collect()
    }
}

/// Adds points to a job's curve, within somebody's changes.
pub(super) async fn extend(
    writing: &mut Writing<'_>,
    id: &str,
    curve: &[Generation],
) -> Result<(), StoreError> {
    for figures in curve {
        let query = writing.dialect.query(
            "INSERT INTO generations (job, generation, figures) VALUES ($1, $2, $3)
             ON CONFLICT (job, generation) DO UPDATE SET figures = excluded.figures",
        );
        let query = query.bind(id).bind(i64::from(figures.generation)).bind(document(figures)?);
        writing.execute(query).await?;
    }
    Ok(())
}

/// Forgets a job's curve, within somebody's changes.
pub(super) async fn forget(writing: &mut Writing<'_>, id: &str) -> Result<(), StoreError> {
    let query = writing.dialect.query("DELETE FROM generations WHERE job = $1");
    writing.execute(query.bind(id)).await?;
    Ok(())
}
