"""What the commands share: arguments, networks, outcomes, reports. Computes nothing."""
