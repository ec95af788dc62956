//! The file readers and the demos as the window's library.
