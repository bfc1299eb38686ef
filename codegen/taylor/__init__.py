"""Steps of Taylor methods: recurrences of power series straight from expressions; neither the driver nor the disk."""
