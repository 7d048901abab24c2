//! Which form of a document a client prefers (RFC 9110, section 12.5.1).

use axum::http::HeaderMap;
use axum::http::header::ACCEPT;

/// How much a form is liked, 0 to 1, and the place in the header that says so.
type Liking = (f64, usize);

/// Whether the header Accept prefers CSV to JSON: by weight, and of equal weights what it names first. JSON where
/// it does not tell them apart.
pub(super) fn prefers_csv(headers: &HeaderMap) -> bool {
    let values = headers.get_all(ACCEPT).iter().filter_map(|value| value.to_str().ok());
    let accepted: Vec<(String, f64)> = values.flat_map(|value| value.split(',')).map(read).collect();
    let (csv, csv_place) = liking(&accepted, ["text/csv", "text/*", "*/*"]);
    let (json, json_place) = liking(&accepted, ["application/json", "application/*", "*/*"]);
    csv > json || (csv == json && csv > 0.0 && csv_place < json_place)
}

/// What the most specific of `ranges` that is named says.
fn liking(accepted: &[(String, f64)], ranges: [&str; 3]) -> Liking {
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
