// Stub of the parts of NUnit that the package's own tests use.
using System;

namespace NUnit.Framework
{
    public class TestAttribute : Attribute { }
    public class AssertionException : Exception { public AssertionException(string message) : base(message) { } }
    public class IgnoreException : Exception { public IgnoreException(string message) : base(message) { } }

    public class Assert
    {
        public static void IsTrue(bool condition, string message, params object[] args) { if (!condition) throw new AssertionException(message); }
        public static void IsFalse(bool condition, string message, params object[] args) { IsTrue(!condition, message); }
        public static void Ignore(string message) { throw new IgnoreException(message); }
    }
}
