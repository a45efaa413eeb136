"""Work that is queued: how it comes into the queue, is waited for and is cancelled."""
