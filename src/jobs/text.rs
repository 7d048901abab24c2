//! Values that documents hold as text, as a command line does.

/// Gives a type that is read from text and written as it the conversions that serde asks for: its container has
/// `#[serde(try_from = "String", into = "String")]`.
macro_rules! as_text {
    ($type:ty, $error:ty) => {
        impl TryFrom<String> for $type {
            type Error = $error;

            fn try_from(text: String) -> Result<Self, $error> {
                text.parse()
            }
        }

        impl From<$type> for String {
            fn from(value: $type) -> Self {
                value.to_string()
            }
        }
    };
}

pub(super) use as_text;
