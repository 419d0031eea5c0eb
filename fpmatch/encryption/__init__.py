"""Encryption at rest: keys and their sources, sealed records, and blocks of files.

`load_keys` reads keys, `seal` and `unseal` protect one record, `SealedBlocks` the blocks of a large
file. All is AES-256-GCM of the package ``cryptography`` (extra ``fpmatch[encryption]``), under keys
derived by HKDF-SHA256.
"""
