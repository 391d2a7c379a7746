//! Contains nothing: this package only has dependencies.
