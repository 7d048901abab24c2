//! Tokens: secrets that clients bring, of which only digests are kept.

use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};
use sha2::{Digest, Sha256};
use subtle::ConstantTimeEq;

/// How a digest is written in place of the token itself.
const DIGEST: &str = "sha256:";

/// The digest of a token: of equal length whatever the token is, and no secret itself if the token is long enough.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct TokenDigest([u8; 32]);

/// A token that cannot be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TokenError {
    /// Nothing.
    #[error("the token is empty")]
    Empty,
    /// A client could not send it, or not in a list.
    #[error("a token consists of visible ASCII characters other than the comma")]
    Character,
    /// Said to be a digest.
    #[error("{DIGEST} is followed by 64 hexadecimal digits")]
    Digest,
    /// Without a name, or with one that cannot be used.
    #[error("each token has a name of letters, digits, - and _; in a list it is given as name=token")]
    Name,
    /// Two tokens of one name.
    #[error("a name is given twice")]
    Twice,
}

impl TokenDigest {
    /// That of the token `secret`.
    pub(super) fn of(secret: &[u8]) -> Self {
        Self(Sha256::digest(secret).into())
    }
}

/// A token, or its digest as `sha256:…`.
impl FromStr for TokenDigest {
    type Err = TokenError;

    fn from_str(text: &str) -> Result<Self, TokenError> {
        if let Some(digits) = text.strip_prefix(DIGEST) {
            return digest(digits).map(Self).ok_or(TokenError::Digest);
        }
        match text {
            "" => Err(TokenError::Empty),
            text if text.bytes().all(|byte| byte.is_ascii_graphic() && byte != b',') => {
                Ok(Self::of(text.as_bytes()))
            }
            _ => Err(TokenError::Character),
        }
    }
}

fn digest(digits: &str) -> Option<[u8; 32]> {
    let hexadecimal = digits.len() == 64 && digits.bytes().all(|digit| digit.is_ascii_hexdigit());
    let mut bytes = [0; 32];
    for (byte, at) in bytes.iter_mut().zip((0..).step_by(2)) {
        *byte = u8::from_str_radix(digits.get(at..at + 2).filter(|_| hexadecimal)?, 16).ok()?;
    }
    Some(bytes)
}

impl fmt::Display for TokenDigest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(DIGEST)?;
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl fmt::Debug for TokenDigest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl Serialize for TokenDigest {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for TokenDigest {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(D::Error::custom)
    }
}

/// The tokens that open the service, by the name of their caller.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(try_from = "BTreeMap<String, TokenDigest>")]
pub struct Tokens(BTreeMap<String, TokenDigest>);

impl Tokens {
    /// One token.
    pub fn one(name: &str, token: TokenDigest) -> Self {
        Self(BTreeMap::from([(name.to_owned(), token)]))
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// These and those of `others`, which take the place of these where names are the same.
    pub fn extended(mut self, others: Self) -> Self {
        self.0.extend(others.0);
        self
    }

    /// The name of the token with this digest. Neither its place nor that of the first difference shows in the time that
    /// this takes.
    pub(super) fn name(&self, given: &TokenDigest) -> Option<String> {
        self.0.iter().fold(
            None,
            |found, (name, own)| {
                if bool::from(own.0.ct_eq(&given.0)) { Some(name.clone()) } else { found }
            },
        )
    }
}

impl TryFrom<BTreeMap<String, TokenDigest>> for Tokens {
    type Error = TokenError;

    fn try_from(tokens: BTreeMap<String, TokenDigest>) -> Result<Self, TokenError> {
        let usable = |letter: u8| letter.is_ascii_alphanumeric() || b"-_".contains(&letter);
        let named = |name: &String| !name.is_empty() && name.bytes().all(usable);
        if tokens.keys().all(named) { Ok(Self(tokens)) } else { Err(TokenError::Name) }
    }
}

/// `name=token`, with commas between several.
impl FromStr for Tokens {
    type Err = TokenError;

    fn from_str(text: &str) -> Result<Self, TokenError> {
        let mut tokens = BTreeMap::new();
        for entry in text.split(',') {
            let (name, token) = entry.trim().split_once('=').ok_or(TokenError::Name)?;
            if tokens.insert(name.to_owned(), token.parse()?).is_some() {
                return Err(TokenError::Twice);
            }
        }
        tokens.try_into()
    }
}
