"""What the commands share: arguments, outcomes, reports and the doctor."""
