// Of UnityEngine what the package uses, with the signatures of Unity's published reference source
// (UnityCsReference, 6000.7): code that compiles with these compiles with the editor's. They do as much as
// it takes to run the importer: a tree of objects with places, and components that remember what they are given.
using System;
using System.Collections.Generic;
using System.Linq;

namespace UnityEngine
{
    public class Object
    {
        bool isDestroyed;
        public virtual string name { get; set; }
        public HideFlags hideFlags { get; set; }
        public static void DestroyImmediate(Object obj) { obj.isDestroyed = true; obj.OnGone(); }
        public static void Destroy(Object obj) { DestroyImmediate(obj); }
        internal virtual void OnGone() { }
        public static T[] FindObjectsByType<T>(FindObjectsSortMode sortMode) where T : Object { return GameObject.All.SelectMany(each => each.GetComponents<T>()).ToArray(); }
        public static bool operator ==(Object x, Object y) { return IsNull(x) ? IsNull(y) : ReferenceEquals(x, y); }
        public static bool operator !=(Object x, Object y) { return !(x == y); }
        public override bool Equals(object other) { return ReferenceEquals(this, other); }
        public override int GetHashCode() { return base.GetHashCode(); }
        static bool IsNull(Object x) { return ReferenceEquals(x, null) || x.isDestroyed; }
    }

    public enum FindObjectsSortMode { None, InstanceID }
    [Flags] public enum HideFlags { None = 0, HideInHierarchy = 1, HideInInspector = 2, DontSaveInEditor = 4, NotEditable = 8, DontSaveInBuild = 16, DontUnloadUnusedAsset = 32, DontSave = 52, HideAndDontSave = 61 }

    public class Component : Object
    {
        public GameObject gameObject { get; internal set; }
        public override string name { get { return gameObject.name; } set { gameObject.name = value; } }
        public Transform transform { get { return gameObject.transform; } }
        public T GetComponent<T>() { return gameObject.GetComponent<T>(); }
        public T[] GetComponentsInChildren<T>() { return GetComponentsInChildren<T>(false); }
        public T[] GetComponentsInChildren<T>(bool includeInactive) { return gameObject.GetComponentsInChildren<T>(includeInactive); }
        public T GetComponentInParent<T>() { return GetComponentInParent<T>(false); }
        public T GetComponentInParent<T>(bool includeInactive)
        {
            for (var at = transform; at != null; at = at.parent)
            {
                var found = at.gameObject.GetComponent<T>();
                if (found != null) return found;
            }
            return default(T);
        }
    }

    public class Behaviour : Component
    {
        public bool enabled { get; set; }
    }

    public class MonoBehaviour : Behaviour { }

    public sealed class GameObject : Object
    {
        public static readonly List<GameObject> All = new List<GameObject>();  // of the stub
        readonly List<Component> components = new List<Component>();
        public GameObject(string name)
        {
            this.name = name;
            activeSelf = true;
            All.Add(this);
            transform = AddComponent<Transform>();
        }
        public Transform transform { get; private set; }
        public bool activeSelf { get; private set; }
        public void SetActive(bool value) { activeSelf = value; }
        public T AddComponent<T>() where T : Component
        {
            foreach (RequireComponent needed in typeof(T).GetCustomAttributes(typeof(RequireComponent), true))
            {
                foreach (var type in needed.Types) if (!components.Any(type.IsInstanceOfType)) Add(type);
            }
            return (T)Add(typeof(T));
        }
        Component Add(Type type)
        {
            var made = (Component)Activator.CreateInstance(type, true);
            made.gameObject = this;
            components.Add(made);
            return made;
        }
        public string tag { get; set; }
        public T GetComponentInParent<T>(bool includeInactive) { return transform.GetComponentInParent<T>(includeInactive); }
        public IEnumerable<T> GetComponents<T>() { return components.OfType<T>(); }  // Unity returns an array
        public T GetComponent<T>() { return components.OfType<T>().FirstOrDefault(); }
        public T[] GetComponentsInChildren<T>() { return GetComponentsInChildren<T>(false); }
        public T[] GetComponentsInChildren<T>(bool includeInactive)
        {
            var found = new List<T>();
            Collect(found, includeInactive);
            return found.ToArray();
        }
        void Collect<T>(List<T> found, bool includeInactive)
        {
            if (!includeInactive && !activeSelf) return;
            found.AddRange(components.OfType<T>());
            for (var i = 0; i < transform.childCount; i++) transform.GetChild(i).gameObject.Collect(found, includeInactive);
        }
    }

    public class Transform : Component
    {
        readonly List<Transform> children = new List<Transform>();
        protected Transform() { localScale = Vector3.one; }
        public Transform parent { get; private set; }
        public Vector3 localPosition { get; set; }
        public Vector3 localScale { get; set; }
        public Vector3 position { get { return parent == null ? localPosition : parent.TransformPoint(localPosition); } set { localPosition = value; } }
        public Vector3 forward { get; set; }
        public Quaternion rotation { get; set; }
        public Quaternion localRotation { get; set; }
        public int childCount { get { return children.Count; } }
        public Transform GetChild(int index) { return children[index]; }
        public void SetParent(Transform p) { SetParent(p, true); }
        public void SetParent(Transform parent, bool worldPositionStays)
        {
            if (worldPositionStays) throw new NotSupportedException();
            if (this.parent != null) this.parent.children.Remove(this);
            this.parent = parent;
            if (parent != null) parent.children.Add(this);
        }
        public Vector3 InverseTransformPoint(Vector3 position)
        {
            var at = parent == null ? position : parent.InverseTransformPoint(position);
            return new Vector3((at.x - localPosition.x) / localScale.x, (at.y - localPosition.y) / localScale.y, (at.z - localPosition.z) / localScale.z);
        }
        public Vector3 TransformPoint(Vector3 position)  // no turns here
        {
            var at = new Vector3(localPosition.x + localScale.x * position.x, localPosition.y + localScale.y * position.y, localPosition.z + localScale.z * position.z);
            return parent == null ? at : parent.TransformPoint(at);
        }
    }

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

    public class GUIContent
    {
        public static GUIContent none = new GUIContent();
        public GUIContent() { }
        public GUIContent(string text) { }
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

    public enum TextureFormat { RGBA32 = 4, RG16 = 62, R8 = 63 }
    public enum TextureWrapMode { Repeat, Clamp, Mirror, MirrorOnce }
    public enum FilterMode { Point, Bilinear, Trilinear }
    [Flags] public enum DepthTextureMode { None = 0, Depth = 1, DepthNormals = 2, MotionVectors = 4 }
    public enum QueryTriggerInteraction { UseGlobal, Ignore, Collide }

    public sealed class Shader : Object
    {
        public bool isSupported { get { return true; } }
        public static readonly List<string> Names = new List<string>();
        public static Shader Find(string name) { return new Shader { name = name }; }
        public static int PropertyToID(string name)
        {
            if (!Names.Contains(name)) Names.Add(name);
            return Names.IndexOf(name);
        }
    }

    public class Material : Object
    {
        public readonly SortedDictionary<string, object> Values = new SortedDictionary<string, object>();
        public Material(Shader shader) { }
        public Material(Material source)
        {
            name = source.name;
            foreach (var pair in source.Values) Values.Add(pair.Key, pair.Value);
        }
        public void SetTexture(string name, Texture value) { Values[name] = value; }
        public void SetVector(string name, Vector4 value) { Values[name] = value; }
        public void SetFloat(string name, float value) { Values[name] = value; }
        public void SetTexture(int nameID, Texture value) { Values[Shader.Names[nameID]] = value; }
        public void SetVector(int nameID, Vector4 value) { Values[Shader.Names[nameID]] = value; }
        public void SetFloat(int nameID, float value) { Values[Shader.Names[nameID]] = value; }
        public void SetColor(int nameID, Color value) { Values[Shader.Names[nameID]] = value; }
        public Vector4 GetVector(int nameID) { return (Vector4)Values[Shader.Names[nameID]]; }
    }

    public sealed class MaterialPropertyBlock
    {
        public SortedDictionary<string, object> Values = new SortedDictionary<string, object>();
        public void SetTexture(int nameID, Texture value) { Values[Shader.Names[nameID]] = value; }
        public void SetFloat(int nameID, float value) { Values[Shader.Names[nameID]] = value; }
        public void SetVector(int nameID, Vector4 value) { Values[Shader.Names[nameID]] = value; }
        public void SetColor(int nameID, Color value) { Values[Shader.Names[nameID]] = value; }
    }

    public sealed class Mesh : Object
    {
        public Vector3[] vertices { get; set; }
        public int[] triangles { get; set; }
        public void RecalculateBounds() { }
        public void SetTriangles(int[] triangles, int trianglesStart, int trianglesLength, int submesh, bool calculateBounds = true, int baseVertex = 0)
        {
            this.triangles = triangles.Skip(trianglesStart).Take(trianglesLength).ToArray();
        }
    }

    public sealed class MeshFilter : Component
    {
        public Mesh sharedMesh { get; set; }
    }

    public class Renderer : Component
    {
        public SortedDictionary<string, object> Block;  // of the stub: a copy, as Unity makes one
        public Renderer() { enabled = true; }
        public bool enabled { get; set; }
        public Bounds bounds
        {
            get
            {
                var places = GetComponent<MeshFilter>().sharedMesh.vertices.Select(v => transform.TransformPoint(v)).ToArray();
                return new Bounds { min = places.Aggregate(Vector3.Min), max = places.Aggregate(Vector3.Max) };
            }
        }
        public bool receiveShadows { get; set; }
        public int sortingOrder { get; set; }
        public Rendering.ShadowCastingMode shadowCastingMode { get; set; }
        public Material sharedMaterial { get; set; }
        Material instance;
        public Material material  // an instance of the renderer's own, as Unity makes one
        {
            get
            {
                if (ReferenceEquals(instance, null)) sharedMaterial = instance = new Material(sharedMaterial);
                return instance;
            }
        }
        public void SetPropertyBlock(MaterialPropertyBlock properties) { Block = properties == null ? null : new SortedDictionary<string, object>(properties.Values); }
    }

    public class MeshRenderer : Renderer { }

    public struct LOD
    {
        public LOD(float screenRelativeTransitionHeight, Renderer[] renderers)
        {
            this.screenRelativeTransitionHeight = screenRelativeTransitionHeight;
            fadeTransitionWidth = 0;
            this.renderers = renderers;
        }
        public float screenRelativeTransitionHeight;
        public float fadeTransitionWidth;
        public Renderer[] renderers;
    }

    public class LODGroup : Component
    {
        public LOD[] Lods;
        public Vector3 localReferencePoint { get; set; }
        public float size { get; set; }
        public void SetLODs(LOD[] lods)
        {
            for (var i = 1; i < lods.Length; i++)
            {
                if (lods[i].screenRelativeTransitionHeight >= lods[i - 1].screenRelativeTransitionHeight) throw new ArgumentException("LODs that do not fall");
            }
            Lods = lods;
        }
    }

    public class Collider : Component
    {
        public bool isTrigger { get; set; }
    }

    public class BoxCollider : Collider
    {
        public Vector3 center { get; set; }
        public Vector3 size { get; set; }
    }

    public struct RaycastHit
    {
        public Collider collider { get; internal set; }
    }

    public class Physics
    {
        public const int DefaultRaycastLayers = ~(1 << 2);
        public static Collider Ahead;  // of the stub: what any ray hits
        public static bool Raycast(Vector3 origin, Vector3 direction, out RaycastHit hitInfo, float maxDistance, int layerMask, QueryTriggerInteraction queryTriggerInteraction)
        {
            hitInfo = new RaycastHit { collider = Ahead };
            return Ahead != null && queryTriggerInteraction == QueryTriggerInteraction.Collide;
        }
    }

    public sealed class Camera : Behaviour
    {
        public static Camera main { get; set; }
        public DepthTextureMode depthTextureMode { get; set; }
        public float nearClipPlane { get; set; }
        public CameraClearFlags clearFlags { get; set; }
        public Color backgroundColor { get; set; }
    }

    public enum CameraClearFlags { Skybox = 1, SolidColor = 2, Depth = 3, Nothing = 4 }
    public enum LightType { Spot, Directional, Point }
    public sealed class Light : Behaviour { public LightType type { get; set; } }
    public sealed class AudioListener : Behaviour { }

    public class Time
    {
        public static float unscaledDeltaTime { get; set; }
    }

    public abstract class PropertyAttribute : Attribute { }
    [AttributeUsage(AttributeTargets.Field)] public class TooltipAttribute : PropertyAttribute { public TooltipAttribute(string tooltip) { } }
    [AttributeUsage(AttributeTargets.Field)] public sealed class RangeAttribute : PropertyAttribute { public RangeAttribute(float min, float max) { } }
    [AttributeUsage(AttributeTargets.Field)] public sealed class MinAttribute : PropertyAttribute { public MinAttribute(float min) { } }
    public sealed class HideInInspector : Attribute { }
    public sealed class ContextMenu : Attribute { public ContextMenu(string itemName) { } }
    public sealed class ExecuteAlways : Attribute { }
    [AttributeUsage(AttributeTargets.Class)] public sealed class DisallowMultipleComponent : Attribute { }
    public sealed class AddComponentMenu : Attribute { public AddComponentMenu(string menuName) { } }
    [AttributeUsage(AttributeTargets.Class, AllowMultiple = true)] public sealed class RequireComponent : Attribute
    {
        public readonly Type[] Types;  // of the stub
        public RequireComponent(Type requiredComponent) { Types = new[] { requiredComponent }; }
        public RequireComponent(Type requiredComponent, Type requiredComponent2) { Types = new[] { requiredComponent, requiredComponent2 }; }
    }
    [AttributeUsage(AttributeTargets.Field)] public sealed class SerializeField : Attribute { }
}
