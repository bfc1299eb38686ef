"""Loaded by the process from which others are forked: they start with the kernel in memory."""

import streams

streams.warm()
