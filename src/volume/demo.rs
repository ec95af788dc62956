//! Volumes made in code, opened as `demo:NAME`.
