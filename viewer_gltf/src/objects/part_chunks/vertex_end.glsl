gl_Position = objectEnd(gl_Position);
