"""What a diagnosis says of causes that are in no catalogue, by simulated patterns."""
