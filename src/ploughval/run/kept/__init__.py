"""What is kept of stages under the key of all that they came from; files are whole, one run at a time."""
