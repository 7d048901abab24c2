//! Which form of a document a client prefers (RFC 9110, section 12.5.1).

use axum::http::header::{ACCEPT, VARY};
use axum::http::{HeaderMap, HeaderValue};
use axum::response::Response;

/// The quality value of a form, 0 to 1, and the index of the range in the header that it comes from.
type Quality = (f64, usize);

/// Whether the header Accept prefers CSV to JSON: by weight, and of equal weights what it names first. JSON where
/// the two are equal.
pub(super) fn prefers_csv(headers: &HeaderMap) -> bool {
    let values = headers.get_all(ACCEPT).iter().filter_map(|value| value.to_str().ok());
    let accepted: Vec<(String, f64)> = values.flat_map(|value| value.split(',')).map(read).collect();
    let (csv, csv_place) = quality(&accepted, ["text/csv", "text/*", "*/*"]);
    let (json, json_place) = quality(&accepted, ["application/json", "application/*", "*/*"]);
    csv > json || (csv == json && csv > 0.0 && csv_place < json_place)
}

/// The same answer for those that keep answers: another comes by another header Accept. That it may also be compressed
/// is said with it.
pub(super) fn chosen(mut response: Response) -> Response {
    response.headers_mut().insert(VARY, HeaderValue::from_static("accept, accept-encoding"));
    response
}

/// The quality of the most specific of `ranges` that the header names.
fn quality(accepted: &[(String, f64)], ranges: [&str; 3]) -> Quality {
    let named = |range: &str| accepted.iter().position(|(name, _)| name == range);
    let place = ranges.into_iter().find_map(named);
    place.map_or((0.0, usize::MAX), |place| (accepted[place].1, place))
}

/// A media range in lower case, without its parameters, and its weight.
fn read(range: &str) -> (String, f64) {
    let mut parts = range.split(';').map(|part| part.trim().to_ascii_lowercase());
    let name = parts.next().unwrap_or_default();
    let weight = parts.find_map(|part| part.strip_prefix("q=")?.parse().ok());
    (name, weight.unwrap_or(1.0))
}
