//! Which door is open to whom.

use crate::store::row::Role;
use axum::http::Method;

/// Who may use a door.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Anybody, also without a token.
    Open,
    /// Any of these, and `admin`.
    Roles(&'static [Role]),
}

const READ: Access = Access::Roles(&[Role::Read, Role::Submit]);
const SUBMIT: Access = Access::Roles(&[Role::Submit]);
const WORK: Access = Access::Roles(&[Role::Work]);
const FILES: Access = Access::Roles(&[Role::Read, Role::Submit, Role::Work]);
const ADMIN: Access = Access::Roles(&[]);

/// Every door: method, path as the router has it, and who may use it. `HEAD` is as `GET`.
pub const DOORS: [(Method, &str, Access); 32] = [
    (Method::POST, "/v1/scenes", SUBMIT),
    (Method::PUT, "/v1/scenes/{id}", SUBMIT),
    (Method::GET, "/v1/scenes/{id}", FILES),
    (Method::GET, "/v1/scenes/{id}/bytes", FILES),
    (Method::POST, "/v1/jobs", SUBMIT),
    (Method::GET, "/v1/jobs", READ),
    (Method::GET, "/v1/jobs/{id}", READ),
    (Method::PATCH, "/v1/jobs/{id}", SUBMIT),
    (Method::DELETE, "/v1/jobs/{id}", SUBMIT),
    (Method::GET, "/v1/jobs/{id}/events", READ),
    (Method::GET, "/v1/jobs/{id}/image.exr", READ),
    (Method::GET, "/v1/jobs/{id}/image.png", READ),
    (Method::GET, "/v1/jobs/{id}/pixel", READ),
    (Method::GET, "/v1/jobs/{id}/error.json", READ),
    (Method::GET, "/v1/jobs/{id}/error.csv", READ),
    (Method::GET, "/v1/jobs/{id}/error.svg", READ),
    (Method::POST, "/v1/workers", WORK),
    (Method::GET, "/v1/workers", READ),
    (Method::GET, "/v1/workers/{id}", READ),
    (Method::DELETE, "/v1/workers/{id}", ADMIN),
    (Method::POST, "/v1/workers/{id}/exchange", WORK),
    (Method::PUT, "/v1/leases/{id}/sum", WORK),
    (Method::POST, "/v1/leases/{id}/sum", WORK),
    (Method::POST, "/v1/leases/{id}/failure", WORK),
    (Method::GET, "/v1/scaling", READ),
    (Method::GET, "/v1/caller", FILES),
    (Method::GET, "/metrics", READ),
    (Method::GET, "/healthz", Access::Open),
    (Method::GET, "/readyz", Access::Open),
    (Method::GET, "/openapi.json", Access::Open),
    (Method::GET, "/docs", Access::Open),
    (Method::GET, "/", Access::Open),
];

/// Who may use the door at `path`. Where there is none, that is so for everybody; another method of a door is
/// for `admin`.
pub fn access(method: &Method, path: &str) -> Access {
    let method = if *method == Method::HEAD { &Method::GET } else { method };
    let mut at = DOORS.iter().filter(|(_, door, _)| leads_to(path, door)).peekable();
    if at.peek().is_none() {
        return Access::Open;
    }
    at.find(|(of, ..)| of == method).map_or(ADMIN, |(.., access)| *access)
}

fn leads_to(path: &str, door: &str) -> bool {
    let (mut path, mut door) = (path.split('/'), door.split('/'));
    loop {
        match (path.next(), door.next()) {
            (None, None) => return true,
            (Some(part), Some("{id}")) if !part.is_empty() => {}
            (Some(part), Some(name)) if part == name => {}
            _ => return false,
        }
    }
}

impl Access {
    /// Whether a caller with that role may.
    pub fn allows(self, role: Role) -> bool {
        match self {
            Self::Open => true,
            Self::Roles(roles) => role == Role::Admin || roles.contains(&role),
        }
    }

    /// Whether only workers come here: they come often, and are bound by what they are told.
    pub fn is_work(self) -> bool {
        self == WORK
    }
}
