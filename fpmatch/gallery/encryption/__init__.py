"""Encryption of stored data: keys and their sources, and encrypted records.

`load_keys` reads keys, `seal` and `unseal` protect one record. All is AES-256-GCM of the package
``cryptography`` (extra ``fpmatch[encryption]``), under keys derived by HKDF-SHA256.
"""
