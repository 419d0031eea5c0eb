"""What is done with a gallery: enrolment, copies, checks, export, rotation of keys, claims."""
