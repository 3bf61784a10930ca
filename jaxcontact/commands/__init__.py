"""What the commands of the command line do; ``__main__`` has their arguments."""
