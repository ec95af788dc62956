//! What is known not to hold yet, as expected failures.
//!
//! Each is a test that states the claim, bears `#[should_panic(expected = "…")]` with the words in
//! which it fails today, and names its issue. The change that makes the claim true turns it into an
//! ordinary test beside the code. There is none now.
