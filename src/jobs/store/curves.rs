//! Learning curves, a row a generation.

use sqlx::{AssertSqlSafe, Row};
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

/// Points that are written by one statement: a long curve, row by row, would keep the job locked for longer than its lease.
const BATCH: usize = 500;

/// Adds points to a job's curve, each generation once, within somebody's changes.
pub(super) async fn extend(
    writing: &mut Writing<'_>,
    id: &str,
    curve: &[Generation],
) -> Result<(), StoreError> {
    for batch in curve.chunks(BATCH) {
        let rows: Vec<String> =
            (1..=batch.len()).map(|row| format!("($1, ${}, ${})", 2 * row, 2 * row + 1)).collect();
        let text = format!(
            "INSERT INTO generations (job, generation, figures) VALUES {}
             ON CONFLICT (job, generation) DO UPDATE SET figures = excluded.figures",
            rows.join(", ")
        );
        // Made of numbers of places alone. Only the usual length is worth being prepared once for all.
        let mut query = sqlx::query(AssertSqlSafe(text)).persistent(batch.len() == 1).bind(id);
        for figures in batch {
            query = query.bind(i64::from(figures.generation)).bind(document(figures)?);
        }
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
