//! Characters kept for later jobs.

use sqlx::Row;
use uuid::Uuid;

use super::connection::{Store, StoreError, document, read};
use crate::jobs::check::Findings;

impl Store {
    /// Keeps a character and what was found in it, and gives its id; the same bytes keep their id.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn keep_character(&self, findings: &Findings, bytes: &[u8]) -> Result<Uuid, StoreError> {
        let mut writing = self.begin().await?;
        let row = sqlx::query(
            "INSERT INTO characters (id, digest, findings, bytes) VALUES (?, ?, ?, ?)
             ON CONFLICT (digest) DO UPDATE SET findings = excluded.findings RETURNING id",
        )
        .bind(Uuid::now_v7().to_string())
        .bind(&findings.digest)
        .bind(document(findings)?)
        .bind(bytes)
        .fetch_one(&mut writing.connection)
        .await?;
        writing.commit().await?;
        let id: String = row.try_get("id")?;
        Uuid::parse_str(&id).map_err(|error| StoreError::Database(sqlx::Error::Decode(error.into())))
    }

    /// What was found in the character called `id`.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn findings(&self, id: Uuid) -> Result<Option<Findings>, StoreError> {
        let row = sqlx::query("SELECT findings FROM characters WHERE id = ?")
            .bind(id.to_string())
            .fetch_optional(&self.readers)
            .await?;
        row.map(|row| read(row.try_get("findings")?)).transpose()
    }

    /// The bytes of the character called `id`.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn character(&self, id: Uuid) -> Result<Option<Vec<u8>>, StoreError> {
        let row = sqlx::query("SELECT bytes FROM characters WHERE id = ?")
            .bind(id.to_string())
            .fetch_optional(&self.readers)
            .await?;
        Ok(row.map(|row| row.try_get("bytes")).transpose()?)
    }
}
