//! Characters kept for later jobs.

use jiff::Timestamp;
use sqlx::Row;
use sqlx::any::AnyRow;
use uuid::Uuid;

use super::database::{Store, StoreError, document, id, read};
use crate::jobs::check::Findings;
use crate::jobs::retention::Expiry;

/// A character in the database.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredCharacter {
    /// The character.
    pub id: Uuid,
    /// `sha256:…` of its bytes.
    pub digest: String,
    /// Its name; `None` where what was found in it cannot be read by this version.
    pub name: Option<String>,
    /// Size of its document, bytes.
    pub bytes: u64,
    /// When it was posted, or a job with it, the last time.
    pub used: Timestamp,
    /// When it goes.
    pub expires: Option<Expiry>,
}

/// What came of a wish to delete a character.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CharacterDeletion {
    /// It is gone.
    Deleted,
    /// There is none of this id.
    Unknown,
    /// This job, which has not ended, needs it.
    Needed(Uuid),
}

impl Store {
    /// Keeps a character and what was found in it, and gives its id; the same bytes keep their id.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn keep_character(&self, findings: &Findings, bytes: &[u8]) -> Result<Uuid, StoreError> {
        let mut writing = self.begin().await?;
        let query = self.dialect.query(
            "INSERT INTO characters (id, digest, findings, bytes, used) VALUES ($1, $2, $3, $4, {now})
             ON CONFLICT (digest) DO UPDATE
             SET findings = excluded.findings, used = excluded.used, expiry = NULL RETURNING id",
        );
        let query = query.bind(Uuid::now_v7().to_string()).bind(findings.digest.as_str());
        let row = writing.row(query.bind(document(findings)?).bind(bytes)).await?;
        writing.commit().await?;
        id(&row.ok_or(sqlx::Error::RowNotFound)?)
    }

    /// At most `limit` characters, the newest first: those older than `after`.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn characters(
        &self,
        after: Option<Uuid>,
        limit: u32,
    ) -> Result<Vec<StoredCharacter>, StoreError> {
        let query = self.dialect.query(
            "SELECT id, digest, length(bytes) AS size, used, expiry, name
             FROM characters WHERE $1 IS NULL OR id < $1 ORDER BY id DESC LIMIT $2",
        );
        let rows = self.rows(query.bind(after.map(|id| id.to_string())).bind(i64::from(limit))).await?;
        rows.iter().map(stored).collect()
    }

    /// Notes that a character is used.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn use_character(&self, id: Uuid) -> Result<(), StoreError> {
        let mut writing = self.begin().await?;
        let query = self.dialect.query("UPDATE characters SET used = {now}, expiry = NULL WHERE id = $1");
        writing.execute(query.bind(id.to_string())).await?;
        writing.commit().await
    }

    /// Has a character say when it goes, or that it stays.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn tell_character(&self, id: Uuid, expires: Option<&Expiry>) -> Result<(), StoreError> {
        let expiry = expires.map(document).transpose()?;
        let mut writing = self.begin().await?;
        let query = self.dialect.query("UPDATE characters SET expiry = $1 WHERE id = $2");
        writing.execute(query.bind(expiry).bind(id.to_string())).await?;
        writing.commit().await
    }

    /// Deletes a character, unless a job that has not ended needs it.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn delete_character(&self, character: Uuid) -> Result<CharacterDeletion, StoreError> {
        let mut writing = self.begin().await?;
        let needed = self.dialect.query(
            "SELECT jobs.id FROM characters JOIN jobs ON jobs.digest = characters.digest
             WHERE characters.id = $1 AND jobs.state IN ('queued', 'running') LIMIT 1",
        );
        if let Some(row) = writing.row(needed.bind(character.to_string())).await? {
            writing.leave().await?;
            return Ok(CharacterDeletion::Needed(id(&row)?));
        }
        let query = self.dialect.query("DELETE FROM characters WHERE id = $1");
        let deleted = writing.execute(query.bind(character.to_string())).await?;
        writing.commit().await?;
        Ok(if deleted == 0 { CharacterDeletion::Unknown } else { CharacterDeletion::Deleted })
    }

    /// What was found in the character called `id`, as the JSON document that the version of this program wrote which found it.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn findings(&self, id: Uuid) -> Result<Option<String>, StoreError> {
        let query = self.dialect.query("SELECT findings FROM characters WHERE id = $1");
        let row = self.row(query.bind(id.to_string())).await?;
        Ok(row.map(|row| row.try_get("findings")).transpose()?)
    }

    /// The bytes of the character called `id`.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn character(&self, id: Uuid) -> Result<Option<Vec<u8>>, StoreError> {
        let query = self.dialect.query("SELECT bytes FROM characters WHERE id = $1");
        let row = self.row(query.bind(id.to_string())).await?;
        Ok(row.map(|row| row.try_get("bytes")).transpose()?)
    }
}

fn stored(row: &AnyRow) -> Result<StoredCharacter, StoreError> {
    let (size, used): (i64, i64) = (row.try_get("size")?, row.try_get("used")?);
    let expiry: Option<&str> = row.try_get("expiry")?;
    Ok(StoredCharacter {
        id: id(row)?,
        digest: row.try_get("digest")?,
        name: row.try_get("name")?,
        bytes: size.unsigned_abs(),
        used: Timestamp::from_millisecond(used).unwrap_or_default(),
        // What cannot be read is told anew.
        expires: expiry.and_then(|expiry| read(expiry).ok()),
    })
}
