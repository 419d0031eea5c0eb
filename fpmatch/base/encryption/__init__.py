"""Encryption at rest: keys and their sources, encrypted records, and large files in blocks.

`load_keys` reads keys, `seal` and `unseal` protect one record, `sealed_blocks` and `unseal_blocks`
a large file. All is AES-256-GCM of the package ``cryptography`` (extra ``fpmatch[encryption]``),
under keys derived by HKDF-SHA256.
"""
