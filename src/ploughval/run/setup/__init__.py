"""Before a test is processed: what its folder holds, a first test.toml, and all that is wrong with it."""
