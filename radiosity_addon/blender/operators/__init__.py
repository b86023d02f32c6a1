"""The operators behind the buttons: each calls one function and reports its errors.

Also Check, Clean and Recover.
"""
