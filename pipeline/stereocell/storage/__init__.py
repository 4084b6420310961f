"""Read, write, lock and recognise files, on this machine and on object storage."""
