"""The commands of the command line; ``__main__`` defines their arguments."""
