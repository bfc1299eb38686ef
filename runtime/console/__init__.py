"""What the commands share: arguments, networks, outcomes, reports, the doctor. Computes nothing."""
