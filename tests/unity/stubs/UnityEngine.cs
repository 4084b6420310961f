// Stub of the parts of UnityEngine that the package uses. Signatures are those of Unity's published reference source
// (UnityCsReference, 6000.7), so code that compiles with the stub also compiles in the editor. The stub does only what
// the importer needs: a tree of objects with positions, and components that store the values they are given.
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
        public bool isActiveAndEnabled { get { return enabled; } }
    }

    public class MonoBehaviour : Behaviour { }

    public sealed class GameObject : Object
    {
        public static readonly List<GameObject> All = new List<GameObject>();  // only in the stub
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
        public Vector3 TransformPoint(Vector3 position)  // the stub has no rotations
        {
            var at = new Vector3(localPosition.x + localScale.x * position.x, localPosition.y + localScale.y * position.y, localPosition.z + localScale.z * position.z);
            return parent == null ? at : parent.TransformPoint(at);
        }
    }

    public class GUIContent
    {
        public static GUIContent none = new GUIContent();
        public GUIContent() { }
        public GUIContent(string text) { }
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
        public SortedDictionary<string, object> Block;  // only in the stub: a copy of the block, as in Unity
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
        public Material material  // makes the renderer's own copy, as in Unity
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
        public static Collider Ahead;  // only in the stub: the collider that every ray hits
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
        public readonly Type[] Types;  // only in the stub
        public RequireComponent(Type requiredComponent) { Types = new[] { requiredComponent }; }
        public RequireComponent(Type requiredComponent, Type requiredComponent2) { Types = new[] { requiredComponent, requiredComponent2 }; }
    }
    [AttributeUsage(AttributeTargets.Field)] public sealed class SerializeField : Attribute { }
}
