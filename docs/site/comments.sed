# Comments use <, > and \ as they are; Doxygen would read them as tags and commands.
/^ *\/\/\//{
  s/\\/\\\\/g
  s/<([A-Za-z_ ]+)>/\&lt;\1\&gt;/g
}
