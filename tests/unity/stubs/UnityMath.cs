// Stub of UnityEngine's vectors, boxes and colours.
using System;

namespace UnityEngine
{
    public struct Vector3
    {
        public float x, y, z;
        public Vector3(float x, float y, float z) { this.x = x; this.y = y; this.z = z; }
        public static Vector3 zero { get { return new Vector3(); } }
        public static Vector3 one { get { return new Vector3(1, 1, 1); } }
        public static float Dot(Vector3 lhs, Vector3 rhs) { return lhs.x * rhs.x + lhs.y * rhs.y + lhs.z * rhs.z; }
        public static Vector3 Cross(Vector3 lhs, Vector3 rhs)
        {
            return new Vector3(lhs.y * rhs.z - lhs.z * rhs.y, lhs.z * rhs.x - lhs.x * rhs.z, lhs.x * rhs.y - lhs.y * rhs.x);
        }
        public float magnitude { get { return (float)Math.Sqrt(Dot(this, this)); } }
        public static Vector3 Min(Vector3 lhs, Vector3 rhs) { return new Vector3(Math.Min(lhs.x, rhs.x), Math.Min(lhs.y, rhs.y), Math.Min(lhs.z, rhs.z)); }
        public static Vector3 Max(Vector3 lhs, Vector3 rhs) { return new Vector3(Math.Max(lhs.x, rhs.x), Math.Max(lhs.y, rhs.y), Math.Max(lhs.z, rhs.z)); }
        public static Vector3 operator +(Vector3 a, Vector3 b) { return new Vector3(a.x + b.x, a.y + b.y, a.z + b.z); }
        public static Vector3 operator -(Vector3 a, Vector3 b) { return new Vector3(a.x - b.x, a.y - b.y, a.z - b.z); }
        public static Vector3 operator *(Vector3 a, float d) { return new Vector3(a.x * d, a.y * d, a.z * d); }
    }

    public struct Vector2 : IEquatable<Vector2>
    {
        public float x, y;
        public Vector2(float x, float y) { this.x = x; this.y = y; }
        public bool Equals(Vector2 other) { return x == other.x && y == other.y; }
    }

    public struct Quaternion
    {
        public float x, y, z, w;
        public static Quaternion Euler(float x, float y, float z) { return new Quaternion(); }
    }

    public struct Vector4
    {
        public float x, y, z, w;
        public Vector4(float x, float y, float z, float w) { this.x = x; this.y = y; this.z = z; this.w = w; }
        public static float Dot(Vector4 a, Vector4 b) { return a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w; }
        public static Vector4 zero { get { return new Vector4(); } }
        public float this[int index]
        {
            get { return index == 0 ? x : index == 1 ? y : index == 2 ? z : w; }
            set
            {
                if (index == 0) x = value;
                else if (index == 1) y = value;
                else if (index == 2) z = value;
                else if (index == 3) w = value;
                else throw new IndexOutOfRangeException();
            }
        }
        public static bool operator ==(Vector4 lhs, Vector4 rhs) { return lhs.x == rhs.x && lhs.y == rhs.y && lhs.z == rhs.z && lhs.w == rhs.w; }
        public static bool operator !=(Vector4 lhs, Vector4 rhs) { return !(lhs == rhs); }
        public override bool Equals(object other) { return other is Vector4 && this == (Vector4)other; }
        public override int GetHashCode() { return x.GetHashCode() ^ y.GetHashCode() ^ z.GetHashCode() ^ w.GetHashCode(); }
    }

    public struct Bounds
    {
        public Vector3 min { get; set; }
        public Vector3 max { get; set; }
        public Vector3 size { get { return max - min; } }
        public void Encapsulate(Bounds bounds) { min = Vector3.Min(min, bounds.min); max = Vector3.Max(max, bounds.max); }
        public void Expand(float amount)
        {
            min -= Vector3.one * (amount / 2);
            max += Vector3.one * (amount / 2);
        }
        public bool Contains(Vector3 point)
        {
            return point.x >= min.x && point.y >= min.y && point.z >= min.z && point.x <= max.x && point.y <= max.y && point.z <= max.z;
        }
    }

    public struct Color
    {
        public float r, g, b, a;
        public static Color black { get { return new Color(0, 0, 0, 1); } }
        public static Color white { get { return new Color(1, 1, 1, 1); } }
        public static bool operator ==(Color lhs, Color rhs) { return lhs.r == rhs.r && lhs.g == rhs.g && lhs.b == rhs.b && lhs.a == rhs.a; }
        public static bool operator !=(Color lhs, Color rhs) { return !(lhs == rhs); }
        public override bool Equals(object other) { return other is Color && this == (Color)other; }
        public override int GetHashCode() { return r.GetHashCode() ^ g.GetHashCode() ^ b.GetHashCode(); }
        public Color(float r, float g, float b, float a) { this.r = r; this.g = g; this.b = b; this.a = a; }
        public Color linear { get { return new Color(Decode(r), Decode(g), Decode(b), a); } }
        public Color gamma { get { return new Color(Encode(r), Encode(g), Encode(b), a); } }
        static float Decode(float c) { return c <= 0.04045f ? c / 12.92f : (float)Math.Pow((c + 0.055) / 1.055, 2.4); }
        static float Encode(float c) { return c <= 0.0031308f ? c * 12.92f : (float)(1.055 * Math.Pow(c, 1 / 2.4) - 0.055); }
    }

    public struct Rect
    {
        public float x { get; set; }
        public float y { get; set; }
        public float width { get; set; }
        public float height { get; set; }
        public Rect(float x, float y, float width, float height) : this() { this.x = x; this.y = y; this.width = width; this.height = height; }
    }

    public struct Mathf
    {
        public const float PI = (float)Math.PI;
        public static float Max(float a, float b) { return Math.Max(a, b); }
        public static float Clamp01(float value) { return Math.Min(Math.Max(value, 0), 1); }
        public static float Sin(float f) { return (float)Math.Sin(f); }
        public static float Cos(float f) { return (float)Math.Cos(f); }
        public static int RoundToInt(float f) { return (int)Math.Round(f); }
    }
}
