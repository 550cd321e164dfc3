"""Object stores by URL: listed, copied from and to, and small documents in them."""
