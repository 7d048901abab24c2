//! What many calls share in the description of the interface: the problems that they may be answered with, and the
//! parameter that names a job.

use std::collections::BTreeMap;

use utoipa::openapi::path::{Parameter, ParameterBuilder, ParameterIn};
use utoipa::openapi::schema::{ObjectBuilder, Type};
use utoipa::openapi::{ContentBuilder, Ref, RefOr, Required, Response, ResponseBuilder};
use utoipa::{IntoParams, IntoResponses};

use super::problem::PROBLEM_JSON;

/// Declares sets of problem responses: a name, and for each HTTP status (or class of statuses) when it is sent.
macro_rules! problems {
    ($($(#[$about:meta])* $name:ident { $($status:literal: $when:literal),+ })+) => {$(
        $(#[$about])*
        pub(super) struct $name;

        impl IntoResponses for $name {
            fn responses() -> BTreeMap<String, RefOr<Response>> {
                BTreeMap::from([$(problem($status, $when)),+])
            }
        }
    )+};
}

problems! {
    /// A job could not be queued.
    NotQueued {
        "409": "The record of the job that was posted under this key cannot be read",
        "422": "What is asked for is impossible, with every fault found; or the key was used for another body",
        "429": "Too many jobs wait, of all or of this caller",
        "503": "Shutting down, or unable to write at present"
    }
    /// A study could not be queued.
    StudyNotQueued {
        "422": "What is asked for is impossible, with every fault found",
        "429": "Too many jobs wait, of all or of this caller",
        "503": "Shutting down, or unable to write at present"
    }
    /// A character was not kept.
    NotKept {
        "422": "The character is impossible, with every fault found",
        "429": "Too much is computed at once",
        "503": "Shutting down, or unable to write at present"
    }
    /// A simulation was not started.
    NotSimulated {
        "422": "What is asked for is impossible, with every fault found, or takes more than 1,000,000 steps",
        "429": "Too many simulations run at once, of all or of this caller"
    }
    /// The id names no character.
    NoSuchCharacter { "404": "No such character" }
    /// The character cannot be deleted.
    CharacterNotDeleted {
        "404": "No such character",
        "409": "A job that has not ended needs it",
        "503": "Unable to write at present"
    }
    /// The id names no job, or a job whose character is part of something else.
    NoCharacter {
        "404": "No such job, or a study, whose character is part of its scenario",
        "409": "The job's record cannot be read"
    }
    /// The job has no curve.
    NoCurve { "404": "No such job, or a study, which has none", "409": "The job's record cannot be read" }
    /// The id names no job.
    NoSuchJob { "404": "No such job", "409": "The job's record cannot be read" }
    /// The job cannot be cancelled.
    NotCancelled { "404": "No such job", "409": "The job has ended otherwise", "503": "Unable to write at present" }
    /// The job cannot be queued again.
    NotRetried {
        "404": "No such job",
        "409": "The job has neither failed nor been cancelled",
        "429": "Too many jobs wait, of all or of this caller",
        "503": "Shutting down, or unable to write at present"
    }
    /// The job cannot be deleted.
    NotDeleted {
        "404": "No such job",
        "409": "The job has not ended, or its record cannot be read and a worker is at it",
        "503": "Unable to write at present"
    }
    /// The job is not followed.
    NotFollowed {
        "404": "No such job",
        "409": "The job's record cannot be read",
        "429": "This caller follows as many streams as one may at once",
        "503": "As many streams are followed as may be at once"
    }
    /// The job has no motion.
    NoMotion { "404": "No such job, or a study, which has none", "409": "The job has not ended, or has no motion" }
    /// The motion was not exported.
    NotExported {
        "404": "No such job or motion, or a study, which has none",
        "409": "The job has not ended, or has no motion",
        "422": "The rate is out of range, or the form cannot hold what is asked for"
    }
    /// The job has no report.
    NoReport { "404": "No such job, or a study, which has none", "409": "The job has not ended, or has no report" }
    /// The job has no table.
    NoTable { "404": "No such job, or one that is no study", "409": "The job has not ended, or has no table" }
    /// The job has no diagram.
    NoDiagram { "404": "No such job, or one that is no study", "409": "The job has not ended, or has no diagram" }
    /// The job has no recording, or not at the range asked for.
    NoRecording {
        "404": "No such job, or a study, which has none",
        "409": "The job has recorded nothing",
        "410": "The recording was removed",
        "412": "The recording has changed since the time given",
        "416": "The range lies beyond the end",
        "429": "This caller follows as many streams as one may at once",
        "503": "As many streams are followed as may be at once"
    }
    /// The service takes no requests.
    NotReady { "503": "Not ready, and why" }
}

/// The response with a problem document for `status`.
fn problem(status: &str, when: &str) -> (String, RefOr<Response>) {
    let schema = Ref::from_schema_name("Problem");
    let content = ContentBuilder::new().schema(Some(schema)).build();
    let response = ResponseBuilder::new().description(when).content(PROBLEM_JSON, content).build();
    (status.to_owned(), RefOr::T(response))
}

/// The id of a job, in the path.
pub(super) struct JobId;

impl IntoParams for JobId {
    fn into_params(_: impl Fn() -> Option<ParameterIn>) -> Vec<Parameter> {
        let id = ParameterBuilder::new()
            .name("id")
            .parameter_in(ParameterIn::Path)
            .required(Required::True)
            .description(Some("The job's id"))
            .schema(Some(ObjectBuilder::new().schema_type(Type::String).build()));
        vec![id.build()]
    }
}

/// Whether the results of a job that has not ended are wanted, in the query.
pub(super) struct PreliminaryQuery;

impl IntoParams for PreliminaryQuery {
    fn into_params(_: impl Fn() -> Option<ParameterIn>) -> Vec<Parameter> {
        let preliminary = ParameterBuilder::new()
            .name("preliminary")
            .parameter_in(ParameterIn::Query)
            .required(Required::False)
            .description(Some(
                "Gives what there is so far of a job that has not ended; JSON is marked `\"preliminary\": true`",
            ))
            .schema(Some(ObjectBuilder::new().schema_type(Type::Boolean).build()));
        vec![preliminary.build()]
    }
}
